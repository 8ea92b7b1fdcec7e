// SPDX-License-Identifier: BSD-3-Clause
//
// Contacts are computed in closed form (sides.cpp), and not by ODE's collision code: everything is an upright
// disc, a box, a wall or the floor, and ODE's generic contact points made pushing depend on the time step.
//
// Model
//   - Floor: friction is Coulomb's, in a circle under each wheel and each foot of the box (rub.hpp). With driven
//     contacts bodies stay level, and what presses on the floor is known by statics; articulated, it is solved for.
//   - Sides: bodies meet in the plane, as discs and rectangles, at one height. A disc's side is a vertical line; the
//     force's centre along it is taken where it tips neither body. Robots meet by their bumpers.
//     Simplification: outlines are those of the upright body; tilts here stay below a few degrees.
//   - A contact is made before touch. It allows no faster approach than closes the gap within the step. So a body
//     never sinks into another by the distance of one step, whatever the time step.
//
// A step
//   - Robots that nothing is near coast in closed form. Those at rest under the same forces as before stay there, and a
//     box that stands is a wall, as long as its feet hold it (box.hpp). All others are solved for: level bodies
//     by Newton's method (compliant.hpp), the articulated drive by ODE.
//   - It is cut where bumpers meet, and where bodies in touch change their speed so much that they would end in the
//   wrong
//     place (average.hpp).
//
// Speeds and lengths are tuned to the E-puck (constants.hpp); scene.cpp refuses what is too fast for them.
#include "world/world.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "error.hpp"
#include "world/average.hpp"
#include "world/box.hpp"
#include "world/compliant.hpp"
#include "world/constants.hpp"
#include "world/drive.hpp"
#include "world/ode.hpp"
#include "world/sides.hpp"

namespace swarmevo {
namespace {

// Potential above rest and kinetic energy [J].
double energy_of(dBodyID body, double resting_height, double gravity) {
    dMass mass;
    dBodyGetMass(body, &mass);
    const dReal *v = dBodyGetLinearVel(body), *w = dBodyGetAngularVel(body);
    dVector3 spin;
    dBodyVectorFromWorld(body, w[0], w[1], w[2], spin);
    double energy = mass.mass * gravity * (dBodyGetPosition(body)[2] - resting_height);
    for (int i = 0; i < 3; ++i) energy += (mass.mass * v[i] * v[i] + mass.I[5 * i] * spin[i] * spin[i]) / 2;
    return energy;
}

std::uint64_t fold(std::uint64_t hash, double value) {
    std::uint64_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    hash = (hash ^ bits) * 0x9E3779B97F4A7C15u;  // odd, so that no difference is lost
    return hash ^ hash >> 29;
}

}  // namespace

struct World::Impl {
    struct Robot {
        int number;  // of its body in `average`
        std::unique_ptr<Drive> drive;
        std::vector<double> resting_heights;  // of its bodies [m]
        bool is_free = true;                  // nothing but the floor is near in this step
        bool coasts = false;                  // and so it needs no solver
        bool is_solved = false;               // its floor contacts are in the step
        bool is_steady = false;               // its wheels' speeds are those of the last step
    };

    const Scene& scene;
    OdeWorld ode;
    Contacts contacts;
    AverageVelocity average;
    Sides sides;
    CompliantStep compliant;
    std::vector<Robot> robots;
    Box box;
    int box_number;                 // in `average`
    std::vector<dBodyID> bodies;    // all
    std::vector<BodyState> before;  // of them, at the start of the step
    bool is_level;                  // all bodies stay so, and their loads are known
    Extremes extremes;
    unsigned messages = 0, unsolved = 0;
    double length;  // of the coming step, if it is not to be cut [s]

    Impl(const Scene& description, const std::vector<Pose>& starts)
        : scene(description),
          contacts(ode, description.physics),
          average(description.physics.drive == SWE_DRIVE_DRIVEN_CONTACTS),
          sides(description, average),
          compliant(contacts, kForceError * traction_limit(description)),
          box(description, ode.id()),
          is_level(description.physics.drive == SWE_DRIVE_DRIVEN_CONTACTS),
          length(description.physics.time_step) {
        dWorldSetGravity(ode.id(), 0, 0, -scene.physics.gravity);
        dWorldSetERP(ode.id(), scene.physics.contact_erp);
        dWorldSetCFM(ode.id(), scene.physics.contact_cfm);
        dWorldSetAutoDisableFlag(ode.id(), 0);
        robots.resize(starts.size());  // once: ODE keeps pointers to their feedback
        for (std::size_t i = 0; i < starts.size(); ++i) add_robot(robots[i], static_cast<int>(i), starts[i]);
        add_box();
    }

    void add_robot(Robot& robot, int number, const Pose& start) {
        robot.number = number;
        robot.drive = create_drive(scene, ode.id(), start);
        const double pull = traction_limit(scene);
        const double twist =
            scene.physics.wheel_friction * scene.robot.mass * scene.physics.gravity * scene.robot.axle_length / 2;
        average.add_body(robot.drive->body(),
                         {pull / scene.robot.mass, twist / robot_inertia(scene.robot).vertical, scene.robot.radius});
        for (const dBodyID body : robot.drive->bodies()) {
            bodies.push_back(body);
            robot.resting_heights.push_back(dBodyGetPosition(body)[2]);
        }
    }

    void add_box() {
        bodies.push_back(box.body());
        // Friction sits on the corners; turning about the middle each has half a diagonal as its lever.
        const double pull = scene.physics.box_friction * scene.physics.gravity;
        const double gyration_squared = box.reach() * box.reach() / 3;
        box_number = static_cast<int>(robots.size());
        average.add_body(box.body(), {pull, pull * box.reach() / gyration_squared, box.reach()});
    }

    // ---- contacts ----

    static Sides::Solid solid(const Robot& robot) { return {robot.drive->body(), robot.number, 1}; }

    // What each body is expected to do in a step, from how it moves now.
    void expect() {
        box.expect(box.stands() || average.has_settled(box_number));
        for (Robot& robot : robots) robot.drive->expect();
    }

    // What meets in the step, and who is to be solved for.
    void lay_out(double time_step, bool cautious) {
        average.begin(time_step, !is_level || cautious);
        sides.begin();
        box.stand(average.place(box_number));
        for (Robot& robot : robots) {
            const Twist aim = robot.drive->intended_motion();
            average.intend(robot.number, aim.x, aim.y);
            robot.is_free = true;
        }
        for (std::size_t i = 0; i < robots.size(); ++i) add_sides(i);
        const std::vector<char> rest = resting_robots();
        for (Robot& robot : robots) {
            robot.coasts = robot.is_free && robot.drive->can_coast(time_step);
            robot.is_solved = !robot.coasts && !rest[robot.number];
            if (rest[robot.number]) average.hold(robot.number);
            set_enabled(robot.drive->body(), robot.is_solved);
        }
        set_enabled(box.body(), !box.stands());
        if (!box.stands()) sides.add_box_at_walls(box, box_number);
    }

    bool give_way(double time_step) {
        contacts.begin(time_step, false);
        compliant.begin(time_step);
        for (Robot& robot : robots) {
            if (!robot.is_solved) continue;
            const Place& place = average.place(robot.number);
            compliant.add_body(robot.number, robot.drive->body(), place, robot.drive.get());
            robot.drive->add_to(compliant, place);
        }
        if (!box.stands()) {
            compliant.add_body(box_number, box.body(), average.place(box_number), nullptr);
            box.add_to(compliant);
        }
        for (Sides::Pair* pair : sides.pairs()) compliant.add_pair(*pair);
        return compliant.solve();
    }

    // Returns the warnings of ODE's solver.
    unsigned step_by_ode(double time_step, bool soft) {
        contacts.begin(time_step, soft);
        for (Robot& robot : robots) {
            if (!robot.is_solved) continue;
            average.place_body(robot.number);
            robot.drive->add_to(contacts, average.place(robot.number));
        }
        if (!box.stands()) {
            average.place_body(box_number);
            box.add_to(contacts);
        }
        sides.add_to(contacts);
        return ode.step(time_step);
    }

    // Of a robot with walls, box and the robots before it.
    void add_sides(std::size_t number) {
        Robot& robot = robots[number];
        if (sides.add_robot_at_walls(solid(robot))) robot.is_free = false;
        for (std::size_t i = 0; i < number; ++i)
            if (sides.add_robots(solid(robot), solid(robots[i]))) robot.is_free = robots[i].is_free = false;
        if (sides.add_push(solid(robot), box, box_number)) robot.is_free = false;
    }

    // Those that stay as they are in this step, by number: at rest after the last one, under the same forces, and all
    // that touch them alike; a box that stands is like a wall. Among them are robots that push in vain.
    std::vector<char> resting_robots() const {
        std::vector<char> rest(robots.size() + 1);
        // The reference leaves nothing out. Forces settle a little later than motions: not good enough for a sensor of
        // force.
        if (!is_level || scene.sensors.touch_mode == SWE_TOUCH_MODE_FORCE) return rest;
        for (const Robot& robot : robots)
            rest[robot.number] = !robot.is_free && robot.is_steady && average.has_settled(robot.number);
        const auto wake_up = [&](const AverageVelocity::Touch& touch) {
            const bool is_fixed =
                touch.second == AverageVelocity::kWall || (touch.second == box_number && box.stands());
            if (is_fixed || rest[touch.first] == rest[touch.second]) return false;
            rest[touch.first] = rest[touch.second] = false;
            return true;
        };
        const auto& touches = average.touches();
        while (std::any_of(touches.begin(), touches.end(), wake_up)) continue;
        return rest;
    }

    static void stop_if_still(dBodyID body) {
        const dReal *v = dBodyGetLinearVel(body), *w = dBodyGetAngularVel(body);
        if (std::abs(v[0]) + std::abs(v[1]) + std::abs(v[2]) > kLeastSpeed) return;
        if (std::abs(w[0]) + std::abs(w[1]) + std::abs(w[2]) > kLeastSpeed) return;
        dBodySetLinearVel(body, 0, 0, 0);
        dBodySetAngularVel(body, 0, 0, 0);
    }

    static void set_enabled(dBodyID body, bool enabled) {
        if (enabled)
            dBodyEnable(body);
        else
            dBodyDisable(body);
    }

    bool nothing_to_solve() const {
        return std::none_of(bodies.begin(), bodies.end(), [](dBodyID body) { return dBodyIsEnabled(body); });
    }

    // ---- the step ----
    //
    // It rests on what is checked after it: what stands goes on standing, what is not likely to meet does not, speeds
    // change little, and friction that ODE solved for is Coulomb's. Where something did not come true, the step is
    // taken back, and tried with what it showed, or shorter.

    // Of any body's points [m/s].
    double fastest_motion() const {
        const auto speed = [](dBodyID body) {
            const dReal* v = dBodyGetLinearVel(body);
            return norm(v[0], v[1]);
        };
        double fastest = speed(box.body()) + std::abs(dBodyGetAngularVel(box.body())[2]) * box.reach();
        for (const Robot& robot : robots) fastest = std::max(fastest, speed(robot.drive->body()));
        if (!std::isfinite(fastest)) throw Error(SWE_PHYSICS_ERROR, "a body's speed is no longer finite");
        return fastest;
    }

    // Bodies faster than wheels can make them were thrown: what they hit is soon as fast, and may meet a third before
    // the step is over.
    double longest_step() const {
        const double driven = 2 * rim_speed(scene.robot, 1, scene.noise.wheels), speed = fastest_motion();
        return speed > driven ? std::fmax(kThrownWay / speed, kShortestStep) : scene.physics.time_step;
    }

    void step() {
        const double whole = scene.physics.time_step;
        for (double left = whole; left > kShortestStep / 2;) {
            const double longest = std::fmin(length, longest_step());
            left -= solve(left / std::ceil(left / longest - 1e-6));
        }
        note_extremes();
    }

    // How a step is tried.
    struct Attempt {
        double time_step;       // [s]
        double planned = 0;     // where it was cut at a blow: length before [s]
        bool is_new = true;     // of this length
        int tries = 0;          // of this length
        bool cautious = false;  // all that is near is likely to meet
        bool by_ode = false;    // it was solved so
        bool soft = false;      // ODE's contacts give a little
        int stalls = 0;         // of ODE's solver with soft contacts
        bool given_up = false;  // it stalled at all lengths

        void cut(double share) {
            time_step *= share;
            is_new = true;
            tries = 0;
        }
    };

    // Takes a step of this length [s], or a shorter one where it must. Returns how long it was.
    double solve(double time_step) {
        note_states();
        Attempt attempt{time_step};
        for (;;) {
            if (attempt.is_new) expect();
            attempt.is_new = false;
            if (take(attempt) && holds(attempt)) break;
            for (std::size_t i = 0; i < bodies.size(); ++i) set_state(bodies[i], before[i]);
        }
        finish(attempt);
        return attempt.time_step;
    }

    void note_states() {
        before.clear();
        for (const dBodyID body : bodies) before.push_back(state_of(body));
    }

    // False where ODE's solver stalled: where rows of its contact problem tie, it may drop the rest of them ("LCP
    // internal error"), and robots would sink into the floor. Then softer contacts, no two alike, then a shorter step.
    bool take(Attempt& attempt) {
        lay_out(attempt.time_step, attempt.cautious);
        attempt.by_ode = false;
        if (nothing_to_solve()) return true;
        attempt.by_ode = !is_level || attempt.soft || !give_way(attempt.time_step);
        if (!attempt.by_ode) return true;
        const unsigned warnings = step_by_ode(attempt.time_step, attempt.soft);
        messages += warnings;
        if (warnings == 0) return true;
        if (attempt.soft && attempt.stalls == kDeepestHalving) {
            ++unsolved;
            return attempt.given_up = true;
        }
        if (attempt.soft) {
            ++attempt.stalls;
            attempt.cut(0.5);
        }
        attempt.soft = !attempt.soft;
        return false;
    }

    // Did it come out as it was laid out?
    bool holds(Attempt& attempt) {
        if (attempt.given_up) return true;
        const bool kept_clear = average.kept_clear(), fitted = fits(attempt.by_ode) && kept_clear;
        attempt.cautious |= !kept_clear;
        if (ends_at_blow(attempt)) return false;
        const double share = shortening(attempt.time_step);
        // Far too long a step is cut before anything else is mended.
        if (share <= kFarTooLong || (share < 1 && fitted)) {
            attempt.cut(share);
            return false;
        }
        return fitted || ++attempt.tries == kMostTries;
    }

    // Is a step to end where bumpers meet within it?
    bool ends_at_blow(Attempt& attempt) const {
        if (!is_level || attempt.planned > 0) return false;
        const double share = average.until_blow();
        if (share == 1 || share * attempt.time_step < kShortestStep) return false;
        attempt.planned = attempt.time_step;
        attempt.cut(share);
        return true;
    }

    bool fits(bool by_ode) {
        bool all = true;
        if (by_ode) {
            all &= sides.fits();
            for (Robot& robot : robots)
                if (robot.is_solved) all &= robot.drive->fits();
        }
        return box.fits(push_on_box(), by_ode) && all;
    }

    double largest_error() const { return scene.robot.bumper == SWE_BUMPER_RIGID ? kRigidWayError : kWayError; }

    // By how much a step of this length is to be cut, in powers of two, since speeds change too much in it.
    double shortening(double time_step) const {
        if (!is_level) return 1;
        double factor = 1, error = average.error();
        for (; error > largest_error() && factor * time_step > kShortestStep; error /= 4) factor /= 2;
        return factor;
    }

    // What robots do to the box.
    Load push_on_box() const {
        const Place& middle = average.place(box_number);
        Load load{};
        for (const Robot& robot : robots) {
            const Sides::Pair& push = sides.push(robot.number);
            if (!push.may_meet) continue;
            const double x = -push.force[0], y = -push.force[1];
            load.x += x;
            load.y += y;
            load.torque += (push.point[0] - middle.x) * y - (push.point[1] - middle.y) * x;
        }
        return load;
    }

    void finish(const Attempt& attempt) {
        const double time_step = attempt.time_step;
        const bool by_ode = attempt.by_ode;
        if (by_ode || nothing_to_solve())
            compliant.forget();
        else
            compliant.remember();
        box.finish(by_ode);
        sides.finish();
        const double error = is_level ? average.error() : 0;
        length = error > 0 ? time_step * std::clamp(std::sqrt(largest_error() / error), 0.5, 2.0) : 2 * time_step;
        length = std::clamp(std::fmax(length, attempt.planned), kShortestStep, scene.physics.time_step);
        // The reference model runs at steps that need no correction.
        if (is_level) average.apply();
        for (const dBodyID body : bodies) stop_if_still(body);
        for (Robot& robot : robots) {
            if (robot.coasts) robot.drive->coast(time_step);
            if (robot.is_solved && by_ode) robot.drive->finish();
            robot.is_steady = true;
        }
        average.settle();
    }

    void note_extremes() {
        extremes.penetration = contacts.deepest_overlap();
        const auto note = [&](dBodyID body, double resting_height) {
            extremes.lift = std::max(extremes.lift, dBodyGetPosition(body)[2] - resting_height);
            extremes.upright = std::min(extremes.upright, dBodyGetRotation(body)[10]);
        };
        for (const Robot& robot : robots) note(robot.drive->body(), robot.resting_heights[0]);
        note(box.body(), box.height());
    }
};

World::World(const Scene& scene, const std::vector<Pose>& starts) : impl_(new Impl(scene, starts)) {}
World::~World() = default;

void World::set_rim_speeds(unsigned robot, double left, double right) {
    Impl::Robot& of = impl_->robots[robot];
    if (of.drive->jolt(left, right) > kJolt) impl_->compliant.forget(of.number);
    of.drive->set_rim_speeds(left, right);
    of.is_steady = false;
}

void World::step() {
    impl_->step();
}

Pose World::robot_pose(unsigned robot) const {
    return pose_of(impl_->robots[robot].drive->body());
}
Pose World::box_pose() const {
    return pose_of(impl_->box.body());
}

double World::push_force(unsigned robot) const {
    const Sides::Pair& push = impl_->sides.push(static_cast<int>(robot));
    return push.may_meet ? push.press() : 0;
}

double World::energy() const {
    const double gravity = impl_->scene.physics.gravity;
    std::vector<Place> robots;
    for (const Impl::Robot& robot : impl_->robots) robots.push_back(place_of(robot.drive->body()));
    double sum = impl_->sides.stored_energy(robots, place_of(impl_->box.body())) +
                 energy_of(impl_->box.body(), impl_->box.height(), gravity);
    for (const Impl::Robot& robot : impl_->robots)
        for (std::size_t i = 0; i < robot.resting_heights.size(); ++i)
            sum += energy_of(robot.drive->bodies()[i], robot.resting_heights[i], gravity);
    return sum;
}

std::uint64_t World::fold_state(std::uint64_t hash) const {
    for (const dBodyID body : impl_->bodies) {
        const BodyState state = state_of(body);
        double sum = 0;  // not finite as soon as one of its terms is not
        for (const auto* values : {state.position, state.velocity, state.spin})
            for (int i = 0; i < 3; ++i) {
                hash = fold(hash, values[i]);
                sum += values[i];
            }
        for (const double value : state.quaternion) {
            hash = fold(hash, value);
            sum += value;
        }
        if (!std::isfinite(sum)) throw Error(SWE_PHYSICS_ERROR, "a body's state is no longer finite");
    }
    return hash;
}

const Extremes& World::extremes() const {
    return impl_->extremes;
}
unsigned World::ode_messages() const {
    return impl_->messages;
}
unsigned World::unsolved_steps() const {
    return impl_->unsolved;
}

}  // namespace swarmevo

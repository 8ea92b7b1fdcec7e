// SPDX-License-Identifier: BSD-3-Clause
//
// Contacts are computed in closed form (world_sides.cpp), and not by ODE's collision code: everything is an upright
// disc, a box, a wall or the floor, and ODE's generic contact points made pushing depend on the time step.
//
// Model
//   - Floor, with driven contacts: bodies stay level, and what presses on the floor is known by statics. So friction
//     alone is solved for, with limits of its own; half of the solver's rows go.
//   - Floor, articulated: each wheel touches below its hub, a caster at its tip, the box at its four corners.
//   - Sides: bodies meet in the plane, as discs and rectangles, at one height. A disc's side is a vertical line; the
//     force's centre along it is taken where it tips neither body.
//     Simplification: outlines are those of the upright body; tilts here stay below a few degrees.
//   - What mostly goes on as it did is assumed to: wheels that slip (world_driven_contacts.cpp), a box that stands or
//     slides (world_box.hpp), gaps that nothing is about to close (world_average.hpp). That leaves a small problem for
//     the solver. Where it did not come true, the step is taken back and solved in full.
//   - A contact is made before touch. It allows no faster approach than closes the gap within the step. So a body
//     never sinks into another by the distance of one step, whatever the time step.
//   - Friction is Coulomb's: in a circle for wheels (world_grip.hpp), else in a pyramid along the given direction. That
//     of sides takes its limit from the normal forces that hold without it.
//
// Speeds and lengths named below are tuned to the E-puck; scene.cpp refuses what is too fast for them.
#include "world.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "error.hpp"
#include "world_average.hpp"
#include "world_box.hpp"
#include "world_drive.hpp"
#include "world_ode.hpp"
#include "world_sides.hpp"

namespace swarmevo {
namespace {

// Speed at which overlaps are pushed apart, at most [m/s]: about a robot's top speed.
constexpr double kLargestCorrection = 0.1;
// A body slower than this stops [m/s], [rad/s]: friction would halve its speed for ever, until it cannot be divided by.
constexpr double kLeastSpeed = 1e-15;
// How often a step is halved at most where ODE's solver stalls.
constexpr int kDeepestHalving = 4;
// Length of the step that a collision takes, and the shortest step that is cut for one [s].
constexpr double kBlow = 2.5e-4, kShortestCut = 1e-3, kHair = 2e-5;
// Collisions in one step that are treated so.
constexpr int kMostCuts = 4;
// Farthest that a body that was thrown moves in one piece of a step [m], since contacts are those of the piece's
// beginning; and pieces at most.
constexpr double kThrownWay = 1e-3, kMostPieces = 1e4;

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
        bool is_steady = false;               // its wheels' speeds are those of the last step
        Sides::Push push;
    };

    const Scene& scene;
    OdeWorld ode;
    Contacts contacts;
    AverageVelocity average;
    Sides sides;
    std::vector<Robot> robots;
    Box box;
    int box_number;               // in `average`
    std::vector<dBodyID> bodies;  // all
    bool is_level;                // all bodies stay so, and their loads are known
    Extremes extremes;
    unsigned messages = 0, unsolved = 0;
    bool cautious = false;  // bodies met in this step that were not likely to
    double prepared = 0;    // the contacts that are there are for a step of this length from the present state [s]

    Impl(const Scene& description, const std::vector<Pose>& starts)
        : scene(description),
          contacts(ode, description.physics),
          sides(description, contacts, average),
          box(description, ode.id()),
          is_level(description.physics.drive == SWE_DRIVE_DRIVEN_CONTACTS) {
        dWorldSetGravity(ode.id(), 0, 0, -scene.physics.gravity);
        dWorldSetERP(ode.id(), scene.physics.contact_erp);
        dWorldSetCFM(ode.id(), scene.physics.contact_cfm);
        dWorldSetContactMaxCorrectingVel(ode.id(), kLargestCorrection);
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
        average.add_body(robot.drive->body(), {pull / scene.robot.mass, twist / robot_inertia(scene.robot).vertical});
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
        average.add_body(box.body(), {pull, pull * box.reach() / gyration_squared});
    }

    // ---- contacts ----

    static Sides::Solid solid(const Robot& robot) { return {robot.drive->body(), robot.number}; }

    // All contacts of a step of this length [s].
    void add_all_contacts(double time_step, bool soft) {
        contacts.begin(time_step, soft);
        average.begin(time_step, !is_level || cautious);
        prepared = soft ? 0 : time_step;
        for (const Robot& robot : robots) {
            robot.drive->forget();
            const Vector aim = robot.drive->intended_velocity();
            average.intend(robot.number, aim[0], aim[1]);
        }
        box.assume(average.has_settled(box_number));
        for (std::size_t i = 0; i < robots.size(); ++i) add_sides(i);
        const std::vector<char> rest = who_rests();
        for (Robot& robot : robots) {
            robot.coasts = robot.is_free && robot.drive->can_coast(time_step);
            const bool is_solved = !robot.coasts && !rest[robot.number];
            set_enabled(robot.drive->body(), is_solved);
            if (is_solved) robot.drive->add_floor_contacts(contacts, time_step, robot.is_free);
        }
        set_enabled(box.body(), !box.stands());
        if (box.stands()) return;
        box.add_floor_contacts(contacts);
        sides.add_box_at_walls(box, box_number);
    }

    // Of a robot with walls, box and the robots before it.
    void add_sides(std::size_t number) {
        using Meeting = Sides::Meeting;
        Robot& robot = robots[number];
        const dReal* p = dBodyGetPosition(robot.drive->body());
        const double wall_height = std::min(scene.arena.wall_height, scene.robot.height) / 2;
        const Meeting walls = sides.add_walls(solid(robot), p[0], p[1], scene.robot.radius, wall_height);
        robot.is_free = walls == Meeting::far;
        for (std::size_t i = 0; i < number; ++i)
            if (sides.add_robots(solid(robot), solid(robots[i])) != Meeting::far)
                robot.is_free = robots[i].is_free = false;
        if (sides.add_push(solid(robot), box, box_number, robot.push) != Meeting::far) robot.is_free = false;
    }

    // Who stays as it is in this step, by number: at rest after the last one, under the same forces, and all that touch
    // it alike; a box that stands is like a wall. Among them are robots that push in vain.
    std::vector<char> who_rests() const {
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
    // step()     the time step; in short pieces where something was thrown
    // advance()  a piece; cut where bodies collide
    // solve()    a cut; taken back and tried again where it went otherwise than assumed, or ODE's solver stalls
    // attempt()  one call of ODE, with the contacts of advance() if they are for the same time
    // finish()   what is to be done after a cut that holds

    // Of any body's points [m/s].
    double fastest_motion() const {
        const auto speed = [](dBodyID body) {
            const dReal* v = dBodyGetLinearVel(body);
            return std::hypot(v[0], v[1]);
        };
        double fastest = speed(box.body()) + std::abs(dBodyGetAngularVel(box.body())[2]) * box.reach();
        for (const Robot& robot : robots) fastest = std::max(fastest, speed(robot.drive->body()));
        if (!std::isfinite(fastest)) throw Error(SWE_PHYSICS_ERROR, "a body's speed is no longer finite");
        return fastest;
    }

    // Bodies faster than wheels can make them were thrown: what they hit is soon as fast, and may meet a third before
    // the step is over. So it is taken in short pieces.
    void step() {
        const double driven = 2 * rim_speed(scene.robot, 1, scene.noise.wheels);
        double left_over = scene.physics.time_step;
        for (double pieces = 0; pieces != 1; left_over -= left_over / pieces) {
            const double speed = fastest_motion();
            pieces = speed > driven ? std::clamp(std::ceil(left_over * speed / kThrownWay), 1.0, kMostPieces) : 1;
            advance(left_over / pieces);
        }
        note_extremes();
    }

    // A step in which bodies collide is cut there: up to the collision, the blow itself, and the rest. In one piece,
    // friction would act before the blow as it does after it.
    void advance(double left_over) {
        for (int cut = 0; cut < kMostCuts && left_over > kShortestCut; ++cut) {
            add_all_contacts(left_over, false);
            const double collision = average.first_collision();
            if (collision >= left_over - kBlow) break;
            // A hair short of it: a gap that closes exactly at the end of a step would tie the solver's rows.
            const double run_up = collision > kBlow ? collision - kHair : 0;
            if (run_up > 0) solve(run_up);
            solve(kBlow);
            left_over -= run_up + kBlow;
        }
        solve(left_over);
    }

    // Where rows of the contact problem tie, ODE's solver may stall and drop the rest of them ("LCP internal error"):
    // robots would sink into the floor. Then the step is taken back and tried again, first with softer contacts, no two
    // alike, then in two halves.
    void solve(double time_step, int depth = 0) {
        std::vector<BodyState> before;
        before.reserve(bodies.size());
        for (const dBodyID body : bodies) before.push_back(state_of(body));
        const auto take_back = [&] {
            for (std::size_t i = 0; i < bodies.size(); ++i) set_state(bodies[i], before[i]);
        };
        for (const bool soft : {false, true}) {
            unsigned warnings = attempt(time_step, soft);
            while (warnings == 0 && !went_as_assumed()) {
                take_back();
                warnings = attempt(time_step, soft);
            }
            messages += warnings;
            if (warnings == 0) return finish(time_step);
            if (soft && depth == kDeepestHalving) break;
            take_back();
        }
        if (depth == kDeepestHalving) {
            ++unsolved;
            return finish(time_step);
        }
        solve(time_step / 2, depth + 1);
        solve(time_step / 2, depth + 1);
    }

    // Returns the warnings of ODE's solver.
    unsigned attempt(double time_step, bool soft) {
        if (soft || prepared != time_step) add_all_contacts(time_step, soft);
        prepared = 0;
        return nothing_to_solve() ? 0 : ode.step(time_step);
    }

    bool went_as_assumed() {
        const bool kept_clear = average.kept_clear();
        cautious |= !kept_clear;
        bool holds = box.moved_as_assumed(push_on_box()) && kept_clear;
        for (const Robot& robot : robots) holds &= robot.drive->slips_as_assumed();
        return holds;
    }

    // What robots do to the box.
    Box::Load push_on_box() const {
        const dReal* middle = dBodyGetPosition(box.body());
        Box::Load load{};
        for (const Robot& robot : robots) {
            if (!robot.push.may_be) continue;
            const double x = -robot.push.joint.f1[0], y = -robot.push.joint.f1[1];
            load.x += x;
            load.y += y;
            load.torque += (robot.push.point[0] - middle[0]) * y - (robot.push.point[1] - middle[1]) * x;
        }
        return load;
    }

    void finish(double time_step) {
        box.finish();
        cautious = false;
        // The reference model runs at steps that need no correction.
        if (is_level) average.apply();
        for (const dBodyID body : bodies) stop_if_still(body);
        for (Robot& robot : robots) {
            if (robot.coasts) robot.drive->coast(time_step);
            robot.drive->finish(time_step);
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
    impl_->robots[robot].drive->set_rim_speeds(left, right);
    impl_->robots[robot].is_steady = false;
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
    const Sides::Push& push = impl_->robots[robot].push;
    if (!push.may_be) return 0;
    return std::max(0.0, push.joint.f1[0] * push.normal[0] + push.joint.f1[1] * push.normal[1]);
}

double World::energy() const {
    const double gravity = impl_->scene.physics.gravity;
    double sum = energy_of(impl_->box.body(), impl_->box.height(), gravity);
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

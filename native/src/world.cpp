// SPDX-License-Identifier: BSD-3-Clause
//
// Contacts are computed here, in closed form, and not by ODE's collision code: everything is an upright disc, a box,
// a wall or the floor, and ODE's generic contact points made pushing depend on the time step.
//
// Model
//   - Floor: each wheel touches below its hub, a caster at its tip, the box at its four corners.
//   - Sides: bodies meet in the plane, as discs and rectangles, at one height. A disc's side is a vertical line; the
//     force's centre along it is taken where it tips neither body.
//     Simplification: outlines are those of the upright body; tilts here stay below about one degree.
//   - A contact is made a little before touch and then allows an approach that closes the gap within the step. So a
//     body never sinks into another by the distance of one step, whatever the time step.
//   - Friction is Coulomb's in a pyramid along the given direction; ODE takes its limit from the normal forces that
//     hold without friction.
#include "world.hpp"

#include <ode/ode.h>

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <mutex>

#include "error.hpp"

namespace swarmevo {
namespace {

// Speed at which overlaps are pushed apart, at most [m/s]: about a robot's top speed.
constexpr double kLargestCorrection = 0.1;
// The box sleeps when slower than this [m/s] and [rad/s], and no robot is near.
constexpr double kRestingSpeed = 1e-4, kRestingSpin = 1e-3;
// Below this speed friction on the box acts along its edges, above along its motion [m/s].
constexpr double kSlidingSpeed = 1e-3;
// Pitch of a robot at the start [rad]: it moves by micrometres until it hangs still.
constexpr double kStartPitch = -1e-4;
// How often a step is tried when ODE's solver stalls, each time with other contact softnesses.
constexpr int kAttempts = 4;
constexpr int kWalls = 4, kBoxCorners = 4;

// ---- ODE's process-wide state
// ----------------------------------------------------------------------------------------

thread_local unsigned ode_messages_of_thread = 0;

void on_message(int, const char*, va_list) {
    ++ode_messages_of_thread;
}

// ODE ends the process when these return, so they throw: the exception passes through ODE's frames to our step.
[[noreturn]] void on_failure(int number, const char* format, va_list arguments) {
    char text[256];
    std::vsnprintf(text, sizeof text, format, arguments);
    throw Error(SWE_PHYSICS_ERROR, "ODE failed (" + std::to_string(number) + "): " + text);
}

void initialise_ode() {
    static std::once_flag once;
    std::call_once(once, [] {
        dInitODE2(0);
        dSetMessageHandler(on_message);
        dSetErrorHandler(on_failure);
        dSetDebugHandler(on_failure);
    });
    thread_local const bool prepared = dAllocateODEDataForThread(dAllocateMaskAll) != 0;
    if (!prepared) throw Error(SWE_OUT_OF_MEMORY, "ODE could not allocate its data for a thread");
}

// A world with a threading implementation of its own: worlds on ODE's default one share it and crash side by side.
class OdeWorld {
  public:
    OdeWorld() {
        initialise_ode();
        id = dWorldCreate();
        contacts = dJointGroupCreate(0);
        threading_ = dThreadingAllocateSelfThreadedImplementation();
        dWorldSetStepThreadingImplementation(id, dThreadingImplementationGetFunctions(threading_), threading_);
    }
    ~OdeWorld() {
        if (broken) return;  // its lists may be half changed: leaking them is safe, walking them is not
        dJointGroupDestroy(contacts);
        dWorldDestroy(id);
        dThreadingFreeImplementation(threading_);
    }
    OdeWorld(const OdeWorld&) = delete;
    OdeWorld& operator=(const OdeWorld&) = delete;

    dWorldID id = nullptr;
    dJointGroupID contacts = nullptr;
    bool broken = false;

  private:
    dThreadingImplementationID threading_ = nullptr;
};

// ---- small geometry
// --------------------------------------------------------------------------------------------------

// ODE's rotation matrices are 3 x 4, row-major.
Vector axis(dBodyID body, int column) {
    const dReal* r = dBodyGetRotation(body);
    return {r[column], r[4 + column], r[8 + column]};
}

Vector to_world(dBodyID body, const Vector& local) {
    const dReal *r = dBodyGetRotation(body), *p = dBodyGetPosition(body);
    Vector world;
    for (int i = 0; i < 3; ++i)
        world[i] = p[i] + r[4 * i] * local[0] + r[4 * i + 1] * local[1] + r[4 * i + 2] * local[2];
    return world;
}

Pose pose_of(dBodyID body) {
    const dReal *p = dBodyGetPosition(body), *r = dBodyGetRotation(body);
    return {p[0], p[1], std::atan2(r[4], r[0])};
}

BodyState state_of(dBodyID body) {
    BodyState state;
    std::copy_n(dBodyGetPosition(body), 3, state.position);
    std::copy_n(dBodyGetQuaternion(body), 4, state.quaternion);
    std::copy_n(dBodyGetLinearVel(body), 3, state.velocity);
    std::copy_n(dBodyGetAngularVel(body), 3, state.spin);
    return state;
}

void set_state(dBodyID body, const BodyState& s) {
    dBodySetPosition(body, s.position[0], s.position[1], s.position[2]);
    dBodySetQuaternion(body, s.quaternion);
    dBodySetLinearVel(body, s.velocity[0], s.velocity[1], s.velocity[2]);
    dBodySetAngularVel(body, s.spin[0], s.spin[1], s.spin[2]);
}

// A body at rest, turned by its heading and then pitched about its own y axis (nose down is positive) [rad].
dBodyID create_body(dWorldID world, const Pose& pose, double height, double pitch, const dMass& mass) {
    dBodyID body = dBodyCreate(world);
    dBodySetMass(body, &mass);
    dBodySetPosition(body, pose.x, pose.y, height);
    dQuaternion turn, nod, both;
    dQFromAxisAndAngle(turn, 0, 0, 1, pose.heading);
    dQFromAxisAndAngle(nod, 0, 1, 0, pitch);
    dQMultiply0(both, turn, nod);
    dBodySetQuaternion(body, both);
    return body;
}

// Potential above rest and kinetic energy [J].
double energy_of(dBodyID body, double resting_height, double gravity) {
    dMass mass;
    dBodyGetMass(body, &mass);
    const dReal* v = dBodyGetLinearVel(body);
    dVector3 spin;
    dBodyVectorFromWorld(body, dBodyGetAngularVel(body)[0], dBodyGetAngularVel(body)[1], dBodyGetAngularVel(body)[2],
                         spin);
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

// ---- the world
// ---------------------------------------------------------------------------------------------------------

struct World::Impl {
    struct Robot {
        dBodyID body;
        double rim_speed[2] = {0, 0};
        dJointFeedback push{};  // on the box, by the last step
        Vector push_normal{};   // from the box to the robot
        bool pushing = false;
    };

    const Scene& scene;
    OdeWorld ode;
    std::vector<Robot> robots;
    dBodyID box;
    double reach;           // gap below which a side contact is made [m]
    double side_height[2];  // where robots touch: the box and walls, each other [m]
    Extremes extremes;
    unsigned messages = 0, unsolved = 0;
    std::vector<BodyState> before;  // the step: robots, then the box
    int attempt = 0;                // of the current step
    unsigned contacts = 0;          // made in the current attempt

    Impl(const Scene& description, const std::vector<Pose>& starts) : scene(description) {
        const auto& physics = scene.physics;
        dWorldSetGravity(ode.id, 0, 0, -physics.gravity);
        dWorldSetERP(ode.id, physics.contact_erp);
        dWorldSetCFM(ode.id, physics.contact_cfm);
        dWorldSetContactMaxCorrectingVel(ode.id, kLargestCorrection);
        dWorldSetAutoDisableFlag(ode.id, 0);

        // Two robots approach each other by at most this within a step, with 50 % to spare for shoves.
        reach = 3 * rim_speed(scene.robot, 1, scene.noise.wheels) * physics.time_step;

        for (const Pose& start : starts) robots.push_back({create_robot(start), {0, 0}, {}, {}, false});
        dMass mass;
        dMassSetBoxTotal(&mass, scene.box.mass, scene.box.size[0], scene.box.size[1], scene.box.size[2]);
        box = create_body(ode.id, {scene.box.pose[0], scene.box.pose[1], scene.box.pose[2]}, scene.box.size[2] / 2, 0,
                          mass);
        side_height[0] = std::min(scene.box.size[2], scene.robot.height) / 2;
        side_height[1] = scene.robot.centre_of_mass;
    }

    dBodyID create_robot(const Pose& start) {
        const Inertia inertia = robot_inertia(scene.robot);
        dMass mass;
        dMassSetParameters(&mass, scene.robot.mass, 0, 0, 0, inertia.horizontal, inertia.horizontal, inertia.vertical,
                           0, 0, 0);
        // A hair off upright: perfect symmetry makes rows of the contact problem tie, and ODE's solver stall.
        return create_body(ode.id, start, scene.robot.centre_of_mass, kStartPitch, mass);
    }

    // ---- contacts ----

    struct Friction {
        Vector direction;      // first friction direction, a unit vector across the normal
        double along, across;  // coefficients
        double surface_speed;  // of the robot's contact surface along the direction, that is its wheel's rim [m/s]
    };

    // `gap` < 0 is an overlap. The normal points from `second` (nullptr: floor or wall) to `first`.
    dJointID add_contact(dBodyID first, dBodyID second, const Vector& point, const Vector& normal, double gap,
                         const Friction& friction) {
        dContact contact{};
        contact.surface.mode =
            dContactMu2 | dContactFDir1 | dContactApprox1_1 | dContactApprox1_2 | dContactMotionN | dContactMotion1;
        contact.surface.mu = friction.along;
        contact.surface.mu2 = friction.across;
        contact.surface.motion1 = friction.surface_speed;
        contact.surface.motionN = gap > 0 ? -gap / scene.physics.time_step : 0;
        std::copy_n(point.begin(), 3, contact.geom.pos);
        std::copy_n(normal.begin(), 3, contact.geom.normal);
        std::copy_n(friction.direction.begin(), 3, contact.fdir1);
        contact.geom.depth = std::max(0.0, -gap);
        if (attempt > 0) soften(contact);
        ++contacts;
        extremes.penetration = std::max(extremes.penetration, -gap);

        const dJointID joint = dJointCreateContact(ode.id, ode.contacts, &contact);
        dJointAttach(joint, first, second);
        return joint;
    }

    // Makes every contact a little softer, no two alike, so that no two of the solver's rows tie.
    void soften(dContact& contact) const {
        const double softness = scene.physics.contact_cfm * (1 + attempt * (1 + contacts % 13 / 13.0));
        contact.surface.mode |= dContactSoftCFM | dContactSlip1 | dContactSlip2;
        contact.surface.soft_cfm = contact.surface.slip1 = contact.surface.slip2 = softness;
    }

    // A contact between sides: horizontal normal, friction along the horizontal tangent only.
    dJointID add_side_contact(dBodyID first, dBodyID second, double x, double y, double height, double normal_x,
                              double normal_y, double gap) {
        return add_contact(first, second, {x, y, height}, {normal_x, normal_y, 0}, gap,
                           {{-normal_y, normal_x, 0}, scene.physics.side_friction, 0, 0});
    }

    void add_floor_contacts(const Robot& robot) {
        constexpr Vector up = {0, 0, 1};
        const Vector leftward = axis(robot.body, 1);
        const double level = std::hypot(leftward[0], leftward[1]);
        const double mu = scene.physics.wheel_friction;
        if (level < 0.5) {  // It fell over: one point below its centre keeps it from sinking.
            const dReal* p = dBodyGetPosition(robot.body);
            const double height = scene.robot.centre_of_mass;
            add_contact(robot.body, nullptr, {p[0], p[1], p[2] - height}, up, p[2] - height, {{1, 0, 0}, mu, mu, 0});
            return;
        }
        const Vector forward = {leftward[1] / level, -leftward[0] / level, 0};

        // The lowest point of a wheel's rim lies below its hub, in the wheel's plane.
        const double radius = scene.robot.wheel_radius, z = leftward[2];
        const Vector down = {leftward[0] * z / level, leftward[1] * z / level, -level};
        for (const Side side : {left, right}) {
            Vector point = to_world(robot.body, wheel_centre(scene.robot, side));
            for (int i = 0; i < 3; ++i) point[i] += radius * down[i];
            add_contact(robot.body, nullptr, point, up, point[2], {forward, mu, mu, robot.rim_speed[side]});
        }
        // Both casters, though only one can touch: which one is not known before a start or stop pitches the body.
        for (const int end : {-1, 1}) {
            const Vector tip = to_world(robot.body, caster_tip(scene.robot, end));
            add_contact(robot.body, nullptr, tip, up, tip[2], {forward, 0, 0, 0});
        }
    }

    void add_wall_contacts(dBodyID body, double x, double y, double radius, double height) {
        const double half = scene.arena.size / 2;
        const double gaps[kWalls] = {half - radius - x, half - radius + x, half - radius - y, half - radius + y};
        constexpr double normals[kWalls][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
        for (int wall = 0; wall < kWalls; ++wall)
            if (gaps[wall] < reach) {
                const double nx = normals[wall][0], ny = normals[wall][1];
                add_side_contact(body, nullptr, x - nx * (radius + gaps[wall]), y - ny * (radius + gaps[wall]), height,
                                 nx, ny, gaps[wall]);
            }
    }

    void add_robot_contacts(const Robot& first, const Robot& second) {
        const dReal *p = dBodyGetPosition(first.body), *q = dBodyGetPosition(second.body);
        const double dx = p[0] - q[0], dy = p[1] - q[1], limit = 2 * scene.robot.radius + reach;
        const double square = dx * dx + dy * dy;
        if (square >= limit * limit || square == 0) return;
        const double distance = std::sqrt(square);
        add_side_contact(first.body, second.body, (p[0] + q[0]) / 2, (p[1] + q[1]) / 2, side_height[1], dx / distance,
                         dy / distance, distance - 2 * scene.robot.radius);
    }

    // True if the robot is so near the box that a contact was made.
    bool add_push_contact(Robot& robot, const Pose& at, double cosine, double sine) {
        const dReal* p = dBodyGetPosition(robot.body);
        const double dx = p[0] - at.x, dy = p[1] - at.y;
        const Separation s = separate_point_from_rectangle(cosine * dx + sine * dy, cosine * dy - sine * dx,
                                                           scene.box.size[0] / 2, scene.box.size[1] / 2);
        const double gap = s.distance - scene.robot.radius;
        robot.pushing = gap < reach;
        if (!robot.pushing) return false;
        robot.push_normal = {cosine * s.normal_x - sine * s.normal_y, sine * s.normal_x + cosine * s.normal_y, 0};
        const dJointID joint = add_side_contact(robot.body, box, at.x + cosine * s.nearest_x - sine * s.nearest_y,
                                                at.y + sine * s.nearest_x + cosine * s.nearest_y, side_height[0],
                                                robot.push_normal[0], robot.push_normal[1], gap);
        if (scene.sensors.touch_mode == SWE_TOUCH_MODE_FORCE) dJointSetFeedback(joint, &robot.push);
        return true;
    }

    // Floor and walls under the box's corners.
    void add_box_contacts(double cosine, double sine) {
        const dReal* v = dBodyGetLinearVel(box);
        const double speed = std::hypot(v[0], v[1]), mu = scene.physics.box_friction;
        const Vector direction =
            speed > kSlidingSpeed ? Vector{v[0] / speed, v[1] / speed, 0} : Vector{cosine, sine, 0};
        for (int corner = 0; corner < kBoxCorners; ++corner) {
            const double x = (corner & 1 ? 0.5 : -0.5) * scene.box.size[0];
            const double y = (corner & 2 ? 0.5 : -0.5) * scene.box.size[1];
            const Vector foot = to_world(box, {x, y, -scene.box.size[2] / 2});
            add_contact(box, nullptr, foot, {0, 0, 1}, foot[2], {direction, mu, mu, 0});
            const Vector edge = to_world(box, {x, y, 0});
            add_wall_contacts(box, edge[0], edge[1], 0, std::min(scene.box.size[2], scene.arena.wall_height) / 2);
        }
    }

    bool box_rests() const {
        const dReal *v = dBodyGetLinearVel(box), *w = dBodyGetAngularVel(box);
        return std::hypot(v[0], v[1], v[2]) < kRestingSpeed && std::hypot(w[0], w[1], w[2]) < kRestingSpin;
    }

    void add_all_contacts() {
        const double wall_height = std::min(scene.arena.wall_height, scene.robot.height) / 2;
        const Pose at = pose_of(box);
        const double cosine = std::cos(at.heading), sine = std::sin(at.heading);
        bool box_is_near = false;
        for (std::size_t i = 0; i < robots.size(); ++i) {
            add_floor_contacts(robots[i]);
            const dReal* p = dBodyGetPosition(robots[i].body);
            add_wall_contacts(robots[i].body, p[0], p[1], scene.robot.radius, wall_height);
            for (std::size_t j = 0; j < i; ++j) add_robot_contacts(robots[i], robots[j]);
            box_is_near |= add_push_contact(robots[i], at, cosine, sine);
        }
        // A box at rest with nobody near stays as it is: it costs nothing until a robot comes.
        if (!box_is_near && box_rests()) {
            dBodySetLinearVel(box, 0, 0, 0);
            dBodySetAngularVel(box, 0, 0, 0);
            dBodyDisable(box);
        } else {
            dBodyEnable(box);
            add_box_contacts(cosine, sine);
        }
    }

    void note_extremes(dBodyID body, double resting_height) {
        extremes.lift = std::max(extremes.lift, dBodyGetPosition(body)[2] - resting_height);
        extremes.upright = std::min(extremes.upright, dBodyGetRotation(body)[10]);
    }

    void remember() {
        before.clear();
        for (const Robot& robot : robots) before.push_back(state_of(robot.body));
        before.push_back(state_of(box));
    }

    void restore() {
        for (std::size_t i = 0; i < robots.size(); ++i) set_state(robots[i].body, before[i]);
        set_state(box, before.back());
    }

    // True if ODE's solver had nothing to complain about.
    bool try_step() {
        ode_messages_of_thread = 0;
        contacts = 0;
        dJointGroupEmpty(ode.contacts);
        add_all_contacts();
        ode.broken = true;  // until the step is over
        if (!dWorldStep(ode.id, scene.physics.time_step))
            throw Error(SWE_OUT_OF_MEMORY, "ODE could not allocate memory for a step");
        ode.broken = false;
        messages += ode_messages_of_thread;
        return ode_messages_of_thread == 0;
    }

    // Where rows of the contact problem tie, ODE's solver may stall and drop the rest of them ("LCP internal error"):
    // robots would sink into the floor. Then the step is taken back and tried again with softer contacts.
    void step() {
        remember();
        bool solved = false;
        for (attempt = 0; attempt < kAttempts && !solved; ++attempt) {
            if (attempt > 0) restore();
            solved = try_step();
        }
        attempt = 0;
        if (!solved) ++unsolved;
        for (const Robot& robot : robots) note_extremes(robot.body, scene.robot.centre_of_mass);
        note_extremes(box, scene.box.size[2] / 2);
    }
};

World::World(const Scene& scene, const std::vector<Pose>& starts) : impl_(new Impl(scene, starts)) {}
World::~World() = default;

void World::set_rim_speeds(unsigned robot, double left, double right) {
    impl_->robots[robot].rim_speed[Side::left] = left;
    impl_->robots[robot].rim_speed[Side::right] = right;
}

void World::step() {
    impl_->step();
}

Pose World::robot_pose(unsigned robot) const {
    return pose_of(impl_->robots[robot].body);
}
Pose World::box_pose() const {
    return pose_of(impl_->box);
}
BodyState World::robot_state(unsigned robot) const {
    return state_of(impl_->robots[robot].body);
}
BodyState World::box_state() const {
    return state_of(impl_->box);
}

double World::push_force(unsigned robot) const {
    const Impl::Robot& r = impl_->robots[robot];
    if (!r.pushing) return 0;
    return std::max(0.0, r.push.f1[0] * r.push_normal[0] + r.push.f1[1] * r.push_normal[1]);
}

double World::energy() const {
    const Scene& scene = impl_->scene;
    double sum = energy_of(impl_->box, scene.box.size[2] / 2, scene.physics.gravity);
    for (const Impl::Robot& robot : impl_->robots)
        sum += energy_of(robot.body, scene.robot.centre_of_mass, scene.physics.gravity);
    return sum;
}

std::uint64_t World::fold_state(std::uint64_t hash) const {
    const auto fold_body = [&](dBodyID body) {
        const BodyState state = state_of(body);
        double sum = 0;  // not finite as soon as one of its terms is not
        for (const auto* values : {state.position, state.velocity, state.spin})
            for (int i = 0; i < 3; ++i) {
                hash = fold(hash, values[i]);
                sum += values[i];
            }
        for (const double value : state.quaternion) hash = fold(hash, value);
        if (!std::isfinite(sum)) throw Error(SWE_PHYSICS_ERROR, "a body's state is no longer finite");
    };
    for (const Impl::Robot& robot : impl_->robots) fold_body(robot.body);
    fold_body(impl_->box);
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

void provoke_ode_assertion() {
    OdeWorld world;
    dWorldStep(world.id, 0);  // "stepsize must be > 0"
}

const char* ode_description() {
    return dCheckConfiguration("ODE_double_precision") ? "ODE " dODE_VERSION ", double precision"
                                                       : "ODE " dODE_VERSION ", single precision";
}

}  // namespace swarmevo

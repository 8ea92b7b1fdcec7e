// SPDX-License-Identifier: BSD-3-Clause
// The robot as a chassis and two wheels: Drive's reference model.
#include <array>
#include <cmath>

#include "world/drive.hpp"

namespace swarmevo {
namespace {

constexpr Vector kUp = {0, 0, 1};
// Pitch of the articulated robot at the start [rad]: it moves by micrometres until it hangs still. Perfect symmetry
// would make rows of the contact problem tie, and ODE's solver stall.
constexpr double kStartPitch = -1e-4;
// Leaning farther than this (sine of the roll), a robot fell over.
constexpr double kFallen = 0.87;

// The floor's plane seen by a robot: unit vectors in it, level.
struct Level {
    Vector forward;
    Vector down_in_wheel_plane;  // unit: from a hub to the lowest point of its rim
};

// Of a body that is not lying on its side.
Level level_of(dBodyID body) {
    const Vector leftward = axis(body, 1);
    const double flat = norm(leftward[0], leftward[1]), z = leftward[2];
    return {{leftward[1] / flat, -leftward[0] / flat, 0}, {leftward[0] * z / flat, leftward[1] * z / flat, -flat}};
}

Vector below(const Vector& hub, double radius, const Vector& down) {
    return {hub[0] + radius * down[0], hub[1] + radius * down[1], hub[2] + radius * down[2]};
}

class Articulated : public Drive {
  public:
    Articulated(const Scene& scene, dWorldID world, const Pose& start) : Drive(scene) {
        const swe_robot_config& robot = scene.robot;
        const Chassis chassis = chassis_of(robot);
        chassis_centre_ = chassis.height;
        dMass mass;
        dMassSetParameters(&mass, chassis.mass, 0, 0, 0, chassis.horizontal, chassis.horizontal, chassis.vertical, 0, 0,
                           0);
        bodies_ = {create_body(world, {start.x, start.y, chassis.height}, start.heading, kStartPitch, mass)};
        for (const Side side : {left, right}) add_wheel(world, start, side);
        loads_.fill(robot.mass * scene.physics.gravity / 2);
    }

    void set_rim_speeds(double left_speed, double right_speed) override {
        Drive::set_rim_speeds(left_speed, right_speed);
        for (const Side side : {left, right})
            dJointSetHingeParam(hinges_[side], dParamVel, rim_speeds_[side] / scene_.robot.wheel_radius);
    }

    double wheel_speed(Side side) const override { return dJointGetHingeAngleRate(hinges_[side]); }

    Twist intended_motion() const override {
        if (has_fallen()) return {0, 0, 0};
        const Vector forward = level_of(body()).forward;
        const double speed = (rim_speeds_[left] + rim_speeds_[right]) / 2;
        const double turning = (rim_speeds_[right] - rim_speeds_[left]) / scene_.robot.axle_length;
        return {speed * forward[0], speed * forward[1], turning};
    }

    void add_to(CompliantStep&, const Place&) override {}  // it is never solved so

    void add_to(Contacts& contacts, const Place&) override {
        if (has_fallen()) return add_fallen_contact(contacts);
        for (const Side side : {left, right}) {
            const Foot foot = foot_of(bodies_[1 + side]);
            const double limit = scene_.physics.wheel_friction * loads_[side];  // by the step before
            if (expects_) rubs_[side].expect(limit, foot.forward, slip(side, foot));
            rubs_[side].add_pressed(contacts, bodies_[1 + side], foot.point, foot.point[2]);
        }
        expects_ = false;
        const Vector forward = level_of(body()).forward;
        for (const int end : {1, -1}) add_caster_contact(contacts, end, forward);
    }

    bool share_loads(const double (&)[2][2]) override { return false; }

    bool fits() override {
        if (has_fallen()) return true;
        bool all = true;
        for (const Side side : {left, right}) {
            const double limit = rubs_[side].limit();
            if (limit > 0) all &= rubs_[side].fits(slip(side, foot_of(bodies_[1 + side])), limit);
        }
        return all;
    }

    void finish() override {
        if (has_fallen()) return;
        for (const Side side : {left, right}) loads_[side] = std::fmax(0, rubs_[side].load());
    }

    bool can_coast(double) const override { return false; }
    void coast(double) override {}

  private:
    bool has_fallen() const { return std::abs(axis(body(), 1)[2]) > kFallen; }

    // A robot on its side: one point below its centre keeps it from sinking.
    void add_fallen_contact(Contacts& contacts) const {
        const dReal* p = dBodyGetPosition(body());
        const double height = scene_.robot.centre_of_mass, mu = scene_.physics.wheel_friction;
        contacts.add(body(), nullptr, {p[0], p[1], p[2] - height}, kUp, p[2] - height, {{1, 0, 0}, mu, mu, 0});
    }

    void add_caster_contact(Contacts& contacts, int end, const Vector& forward) const {
        Vector local = caster_tip(scene_.robot, end);
        local[2] += scene_.robot.centre_of_mass - chassis_centre_;
        const Vector tip = to_world(body(), local);
        contacts.add(body(), nullptr, tip, kUp, tip[2], {forward, 0, 0, 0});
    }

    // The lowest point of a wheel and the direction in which it rolls.
    struct Foot {
        Vector point, forward;
    };

    Foot foot_of(dBodyID wheel) const {
        const Level level = level_of(wheel);
        const dReal* p = dBodyGetPosition(wheel);
        return {below({p[0], p[1], p[2]}, scene_.robot.wheel_radius, level.down_in_wheel_plane), level.forward};
    }

    // Of a wheel over the floor [m/s].
    Vector slip(Side side, const Foot& foot) const {
        dVector3 v;
        dBodyGetPointVel(bodies_[1 + side], foot.point[0], foot.point[1], foot.point[2], v);
        return {v[0], v[1], 0};
    }

    // What is left of the robot without its wheels, such that all together have its mass, centre and inertia about the
    // vertical. Simplification: about horizontal axes the offsets of chassis and hubs from the centre are left out.
    struct Chassis {
        double mass, height, horizontal, vertical;
    };

    static double wheel_mass(const swe_robot_config& robot) { return kWheelShare * robot.mass; }

    static Chassis chassis_of(const swe_robot_config& robot) {
        const double wheels = 2 * wheel_mass(robot), mass = robot.mass - wheels;
        const double height = (robot.mass * robot.centre_of_mass - wheels * robot.wheel_radius) / mass;
        const Inertia whole = robot_inertia(robot);
        const double half_axle = robot.axle_length / 2, r2 = robot.wheel_radius * robot.wheel_radius;
        const double vertical = whole.vertical - wheels * (half_axle * half_axle + r2 / 4);
        const double horizontal = whole.horizontal - wheels * r2 / 2;
        return {mass, height, horizontal, vertical};
    }

    void add_wheel(dWorldID world, const Pose& start, Side side) {
        const swe_robot_config& robot = scene_.robot;
        const double y = wheel_centre(robot, side)[1], r2 = robot.wheel_radius * robot.wheel_radius;
        const Vector hub = {start.x - y * std::sin(start.heading), start.y + y * std::cos(start.heading),
                            robot.wheel_radius};
        dMass mass;  // a thin disc about its own y axis
        const double m = wheel_mass(robot);
        dMassSetParameters(&mass, m, 0, 0, 0, m * r2 / 4, m * r2 / 2, m * r2 / 4, 0, 0, 0);
        const dBodyID wheel = create_body(world, hub, start.heading, 0, mass);
        dBodySetFiniteRotationMode(wheel, 1);  // a wheel spins fast: the small-angle step would change its axis
        bodies_.push_back(wheel);

        const dJointID hinge = dJointCreateHinge(world, nullptr);
        dJointAttach(hinge, wheel, body());
        dJointSetHingeAnchor(hinge, hub[0], hub[1], hub[2]);
        dJointSetHingeAxis(hinge, -std::sin(start.heading), std::cos(start.heading), 0);
        dJointSetHingeParam(hinge, dParamFMax, scene_.robot.motor_torque);
        dJointSetHingeParam(hinge, dParamVel, 0);
        hinges_[side] = hinge;
    }

    std::array<dJointID, 2> hinges_{};
    std::array<double, 2> loads_;  // on the wheels in the last step [N]
    double chassis_centre_ = 0;
};

}  // namespace

std::unique_ptr<Drive> create_articulated(const Scene& scene, dWorldID world, const Pose& start) {
    return std::make_unique<Articulated>(scene, world, start);
}

}  // namespace swarmevo

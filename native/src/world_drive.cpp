// SPDX-License-Identifier: BSD-3-Clause
#include "world_drive.hpp"

#include <array>
#include <cmath>

namespace swarmevo {
namespace {

constexpr Vector kUp = {0, 0, 1};
// Pitch of a robot at the start [rad]: it moves by micrometres until it hangs still. Perfect symmetry would make rows
// of the contact problem tie, and ODE's solver stall.
constexpr double kStartPitch = -1e-4;
// Below this, a robot's lag behind its wheels' speed does not tell which way it is about to pitch [m/s].
constexpr double kSteady = 0.002;
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
    const double flat = std::hypot(leftward[0], leftward[1]), z = leftward[2];
    return {{leftward[1] / flat, -leftward[0] / flat, 0}, {leftward[0] * z / flat, leftward[1] * z / flat, -flat}};
}

Vector below(const Vector& hub, double radius, const Vector& down) {
    return {hub[0] + radius * down[0], hub[1] + radius * down[1], hub[2] + radius * down[2]};
}

// Turned about the vertical.
Vector turned(const Vector& direction, double angle) {
    const double c = std::cos(angle), s = std::sin(angle);
    return {c * direction[0] - s * direction[1], s * direction[0] + c * direction[1], 0};
}

// What both models share.
class FloorDrive : public Drive {
  public:
    explicit FloorDrive(const Scene& scene) : scene_(scene) {}

    void set_rim_speeds(double left_speed, double right_speed) override { rim_speeds_ = {left_speed, right_speed}; }

    Vector intended_velocity() const override {
        if (has_fallen()) return {0, 0, 0};
        const Vector forward = level_of(body()).forward;
        const double speed = (rim_speeds_[left] + rim_speeds_[right]) / 2;
        return {speed * forward[0], speed * forward[1], 0};
    }

  protected:
    bool has_fallen() const { return std::abs(axis(body(), 1)[2]) > kFallen; }

    // A robot on its side: one point below its centre keeps it from sinking.
    void add_fallen_contact(Contacts& contacts) const {
        const dReal* p = dBodyGetPosition(body());
        const double height = scene_.robot.centre_of_mass, mu = scene_.physics.wheel_friction;
        contacts.add(body(), nullptr, {p[0], p[1], p[2] - height}, kUp, p[2] - height, {{1, 0, 0}, mu, mu, 0});
    }

    void add_caster_contact(Contacts& contacts, int end, const Vector& forward, double chassis_centre) const {
        Vector local = caster_tip(scene_.robot, end);
        local[2] += scene_.robot.centre_of_mass - chassis_centre;
        const Vector tip = to_world(body(), local);
        contacts.add(body(), nullptr, tip, kUp, tip[2], {forward, 0, 0, 0});
    }

    const Scene& scene_;
    std::array<double, 2> rim_speeds_{};
};

class DrivenContacts : public FloorDrive {
  public:
    DrivenContacts(const Scene& scene, dWorldID world, const Pose& start) : FloorDrive(scene) {
        const Inertia inertia = robot_inertia(scene.robot);
        dMass mass;
        dMassSetParameters(&mass, scene.robot.mass, 0, 0, 0, inertia.horizontal, inertia.horizontal, inertia.vertical,
                           0, 0, 0);
        bodies_ = {
            create_body(world, {start.x, start.y, scene.robot.centre_of_mass}, start.heading, kStartPitch, mass)};
    }

    void add_floor_contacts(Contacts& contacts, double time_step, bool is_free) override {
        if (has_fallen()) return add_fallen_contact(contacts);
        const Level level = level_of(body());
        const double mu = scene_.physics.wheel_friction;
        // Wheels where they are and as they point in the middle of the step: its start would bend every curve outwards.
        const double half_turn = turning_rate(is_free) * time_step / 2;
        const Vector rolling = turned(level.forward, half_turn);
        const dReal* centre = dBodyGetPosition(body());
        for (const Side side : {left, right}) {
            const Vector hub = to_world(body(), wheel_centre(scene_.robot, side));
            const Vector foot = below(hub, scene_.robot.wheel_radius, level.down_in_wheel_plane);
            const Vector offset = turned({foot[0] - centre[0], foot[1] - centre[1], 0}, half_turn);
            const Vector point = {centre[0] + offset[0], centre[1] + offset[1], foot[2]};
            // Both wheels resist a slide along their common axle: one row of twice the strength does the same, unless
            // a shove loads them unevenly.
            const double across = !is_free ? mu : side == left ? 2 * mu : 0;
            contacts.add(body(), nullptr, point, kUp, point[2], {rolling, mu, across, rim_speeds_[side]});
        }
        // One caster at a time can touch. A free robot's own start or stop tells which; after a shove either may.
        const int end = leading_caster(level.forward);
        add_caster_contact(contacts, end, level.forward, scene_.robot.centre_of_mass);
        if (!is_free) add_caster_contact(contacts, -end, level.forward, scene_.robot.centre_of_mass);
    }

  private:
    // About the vertical in the coming step [rad/s]: as the wheels will turn it, or as a robot in a crowd turns.
    double turning_rate(bool is_free) const {
        return is_free ? (rim_speeds_[right] - rim_speeds_[left]) / scene_.robot.axle_length
                       : dBodyGetAngularVel(body())[2];
    }

    // +1 front, -1 rear: a robot that is about to speed up leans back, one that brakes leans forward.
    int leading_caster(const Vector& forward) const {
        const dReal* v = dBodyGetLinearVel(body());
        const double lag = (rim_speeds_[left] + rim_speeds_[right]) / 2 - (v[0] * forward[0] + v[1] * forward[1]);
        if (std::abs(lag) > kSteady) return lag > 0 ? -1 : 1;
        return axis(body(), 0)[2] > 0 ? -1 : 1;
    }
};

class Articulated : public FloorDrive {
  public:
    Articulated(const Scene& scene, dWorldID world, const Pose& start) : FloorDrive(scene) {
        const swe_robot_config& robot = scene.robot;
        const Chassis chassis = chassis_of(robot);
        chassis_centre_ = chassis.height;
        dMass mass;
        dMassSetParameters(&mass, chassis.mass, 0, 0, 0, chassis.horizontal, chassis.horizontal, chassis.vertical, 0, 0,
                           0);
        bodies_ = {create_body(world, {start.x, start.y, chassis.height}, start.heading, kStartPitch, mass)};
        for (const Side side : {left, right}) add_wheel(world, start, side);
    }

    void set_rim_speeds(double left_speed, double right_speed) override {
        FloorDrive::set_rim_speeds(left_speed, right_speed);
        for (const Side side : {left, right})
            dJointSetHingeParam(hinges_[side], dParamVel, rim_speeds_[side] / scene_.robot.wheel_radius);
    }

    void add_floor_contacts(Contacts& contacts, double, bool) override {
        if (has_fallen()) return add_fallen_contact(contacts);
        const double mu = scene_.physics.wheel_friction;
        for (const Side side : {left, right}) {
            const dBodyID wheel = bodies_[1 + side];
            const Level level = level_of(wheel);
            const dReal* p = dBodyGetPosition(wheel);
            const Vector point = below({p[0], p[1], p[2]}, scene_.robot.wheel_radius, level.down_in_wheel_plane);
            contacts.add(wheel, nullptr, point, kUp, point[2], {level.forward, mu, mu, 0});
        }
        const Vector forward = level_of(body()).forward;
        for (const int end : {1, -1}) add_caster_contact(contacts, end, forward, chassis_centre_);
    }

  private:
    // What is left of the robot without its wheels, such that all together have the robot's mass, centre and inertia.
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

    static constexpr double kWheelShare = 0.06;  // of the robot's mass in each wheel: about 5 g of 80 g

    std::array<dJointID, 2> hinges_{};
    double chassis_centre_ = 0;
};

}  // namespace

std::unique_ptr<Drive> create_drive(const Scene& scene, dWorldID world, const Pose& start) {
    if (scene.physics.drive == SWE_DRIVE_ARTICULATED) return std::make_unique<Articulated>(scene, world, start);
    return std::make_unique<DrivenContacts>(scene, world, start);
}

}  // namespace swarmevo

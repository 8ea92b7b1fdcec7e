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
// A robot that pitches or rolls faster than this [rad/s], or leans farther to a side than this (sine), is not at ease.
constexpr double kCalmSpin = 0.05, kCalmRoll = 0.003;
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
            contacts.add(body(), nullptr, point, kUp, point[2], {rolling, mu, mu, rim_speeds_[side]});
        }
        for (const int end : {1, -1}) add_caster_contact(contacts, end, level.forward, scene_.robot.centre_of_mass);
    }

    // Free wheels that do not slip do what they are told. The forces that this takes must be within their traction;
    // and the robot must be calm, so that its tilt, of a degree at most, can stay as it is.
    bool can_coast(double time_step) const override {
        const dReal *v = dBodyGetLinearVel(body()), *w = dBodyGetAngularVel(body());
        const Vector x = axis(body(), 0), y = axis(body(), 1);
        const double tilting = std::abs(w[0]) + std::abs(w[1]) + std::abs(v[2]) / scene_.robot.axle_length;
        if (tilting > kCalmSpin || std::abs(y[2]) > kCalmRoll || std::abs(x[2]) > 2 * leaning_pitch()) return false;
        const Wanted wanted = wanted_motion();
        const double m = scene_.robot.mass, half_axle = scene_.robot.axle_length / 2;
        const double thrust = m * (wanted.speed - (v[0] * x[0] + v[1] * x[1])) / time_step;
        const double twist = robot_inertia(scene_.robot).vertical * (wanted.turning - w[2]) / time_step / half_axle;
        // The velocity still points to the last step's middle; the next one's is to be reached, and the curve held.
        const double sideways =
            m * (std::abs(v[0] * y[0] + v[1] * y[1]) / time_step + std::abs(wanted.speed * wanted.turning) / 2);
        const double traction = traction_limit(scene_);
        return std::abs(thrust) + std::abs(twist) < traction && sideways < traction;
    }

    void coast(double time_step) override {
        const dReal *p = dBodyGetPosition(body()), *v = dBodyGetLinearVel(body()), *q = dBodyGetQuaternion(body());
        const Wanted wanted = wanted_motion();
        const Vector forward = level_of(body()).forward;
        // Coulomb friction needs |change| / (mu g) to change the speed; on average the change comes half that late.
        const double change = wanted.speed - (v[0] * forward[0] + v[1] * forward[1]);
        const double late = std::abs(change) / (scene_.physics.wheel_friction * scene_.physics.gravity) / 2;
        const double turn_change = wanted.turning - dBodyGetAngularVel(body())[2];
        const double turn_late = std::abs(turn_change) / largest_turning_change() / 2;
        const double turn = wanted.turning * time_step - turn_change * turn_late;
        const Vector mean = turned(forward, turn / 2);
        const double way = wanted.speed * time_step - change * late;

        dQuaternion turn_quaternion, after;
        dQFromAxisAndAngle(turn_quaternion, 0, 0, 1, turn);
        dQMultiply0(after, turn_quaternion, q);
        dBodySetPosition(body(), p[0] + way * mean[0], p[1] + way * mean[1], p[2]);
        dBodySetQuaternion(body(), after);
        dBodySetLinearVel(body(), wanted.speed * mean[0], wanted.speed * mean[1], 0);
        dBodySetAngularVel(body(), 0, 0, wanted.turning);
    }

  private:
    // What rolling wheels do to the body.
    struct Wanted {
        double speed;    // forward [m/s]
        double turning;  // about the vertical [rad/s]
    };

    Wanted wanted_motion() const {
        return {(rim_speeds_[left] + rim_speeds_[right]) / 2,
                (rim_speeds_[right] - rim_speeds_[left]) / scene_.robot.axle_length};
    }

    // By both wheels' traction [rad/s^2].
    double largest_turning_change() const {
        return traction_limit(scene_) * scene_.robot.axle_length / 2 / robot_inertia(scene_.robot).vertical;
    }

    // Sine of the pitch of a robot that leans on a caster.
    double leaning_pitch() const { return scene_.robot.caster_clearance / scene_.robot.caster_offset; }

    // About the vertical in the coming step [rad/s]: as the wheels will turn it, or as a robot in a crowd turns.
    double turning_rate(bool is_free) const {
        return is_free ? wanted_motion().turning : dBodyGetAngularVel(body())[2];
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

    bool can_coast(double) const override { return false; }
    void coast(double) override {}

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

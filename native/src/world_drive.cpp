// SPDX-License-Identifier: BSD-3-Clause
#include "world_drive.hpp"

#include <array>
#include <cmath>

namespace swarmevo {
namespace {

constexpr Vector kUp = {0, 0, 1};
// Pitch of the articulated robot at the start [rad]: it moves by micrometres until it hangs still. Perfect symmetry
// would make rows of the contact problem tie, and ODE's solver stall.
constexpr double kStartPitch = -1e-4;
// Leaning farther than this (sine of the roll), a robot fell over.
constexpr double kFallen = 0.87;
// A wheel that slips slower than this grips [m/s].
constexpr double kGripSpeed = 0.03;
// The direction of slip is smoothed over this time [s]: steps of 50 ms see it too late.
constexpr double kSlipMemory = 0.1;

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

// How a wheel's friction divides between its rolling direction and the one across. ODE limits each by itself, to a
// pyramid in whose corners a wheel would pull 1.4 times as hard. One that slips rubs against its slip: so each
// direction gets the slip's share of the limit, and both together are Coulomb's circle.
class Grip {
  public:
    // What the foot did in a step of this length [s]: its velocity over the floor [m/s].
    void note_slip(double along, double across, double time_step) {
        if (std::hypot(along, across) < kGripSpeed) {
            grips_ = true;
            return;
        }
        if (grips_) angle_ = 0;
        grips_ = false;
        const double angle = std::atan2(std::abs(across), std::abs(along));
        angle_ += time_step / (time_step + kSlipMemory) * (angle - angle_);
    }

    // Shares of the limit.
    double along() const { return grips_ ? 1 : std::cos(angle_); }
    double across() const { return grips_ ? 1 : std::sin(angle_); }

  private:
    bool grips_ = true;
    double angle_ = 0;  // of the slip to the rolling direction, smoothed [rad]
};

// What both models share.
class FloorDrive : public Drive {
  public:
    explicit FloorDrive(const Scene& scene) : scene_(scene) {}

    void set_rim_speeds(double left_speed, double right_speed) override { rim_speeds_ = {left_speed, right_speed}; }

  protected:
    const Scene& scene_;
    std::array<double, 2> rim_speeds_{};
    std::array<Grip, 2> grips_;
};

class DrivenContacts : public FloorDrive {
  public:
    DrivenContacts(const Scene& scene, dWorldID world, const Pose& start) : FloorDrive(scene) {
        bodies_ = {create_level_body(world, {start.x, start.y, scene.robot.centre_of_mass}, start.heading,
                                     scene.robot.mass, robot_inertia(scene.robot).vertical)};
    }

    Vector intended_velocity() const override {
        const Vector forward = axis(body(), 0);
        const double speed = wanted_motion().speed;
        return {speed * forward[0], speed * forward[1], 0};
    }

    void add_floor_contacts(Contacts& contacts, double time_step, bool is_free) override {
        // Wheels where they are and as they point in the middle of the step: its start would bend every curve outwards.
        const Vector rolling = turned(axis(body(), 0), turning_rate(is_free) * time_step / 2);
        const double mu = scene_.physics.wheel_friction;
        const std::array<double, 2> loads = wheel_loads();
        // Both wheels resist a slide along their common axle: one row with both limits does the same.
        const double across = mu * (grips_[left].across() + grips_[right].across() * loads[right] / loads[left]);
        const dReal* centre = dBodyGetPosition(body());
        for (const Side side : {left, right}) {
            const double y = wheel_centre(scene_.robot, side)[1];
            const double along = mu * grips_[side].along() * (side == left ? 1 + kTieBreak : 1);
            const dJointID joint =
                contacts.add_level(body(), centre[0] - y * rolling[1], centre[1] + y * rolling[0],
                                   {rolling, along, side == left ? across : 0, rim_speeds_[side], loads[side]});
            dJointSetFeedback(joint, &feedback_[side]);
        }
        full_grip_ = mu * (loads[left] + loads[right]);
    }

    void finish(double time_step) override {
        note_forces();
        const dReal* v = dBodyGetLinearVel(body());
        const Vector x = axis(body(), 0);
        const double forward = v[0] * x[0] + v[1] * x[1], across = v[1] * x[0] - v[0] * x[1];
        const double turning = dBodyGetAngularVel(body())[2];
        for (const Side side : {left, right}) {
            const double rolling = forward - turning * wheel_centre(scene_.robot, side)[1];
            grips_[side].note_slip(rolling - rim_speeds_[side], across, time_step);
        }
    }

    // Free wheels that do not slip do what they are told. The forces that this takes must be within their traction.
    bool can_coast(double time_step) const override {
        const dReal *v = dBodyGetLinearVel(body()), *w = dBodyGetAngularVel(body());
        const Vector x = axis(body(), 0), y = axis(body(), 1);
        const Wanted wanted = wanted_motion();
        const double m = scene_.robot.mass, half_axle = scene_.robot.axle_length / 2;
        const double thrust = m * (wanted.speed - (v[0] * x[0] + v[1] * x[1])) / time_step;
        const double twist = robot_inertia(scene_.robot).vertical * (wanted.turning - w[2]) / time_step / half_axle;
        // The velocity still points to the last step's middle; the next one's is to be reached, and the curve held.
        const double sideways =
            m * (std::abs(v[0] * y[0] + v[1] * y[1]) / time_step + std::abs(wanted.speed * wanted.turning) / 2);
        // Of the whole weight's friction: a thrust also takes load off the wheels.
        const double whole = scene_.physics.wheel_friction * m * scene_.physics.gravity;
        const double forward = std::abs(thrust) * whole / traction_limit(scene_) + std::abs(twist);
        return forward * forward + sideways * sideways < whole * whole;
    }

    void coast(double time_step) override {
        const dReal *p = dBodyGetPosition(body()), *v = dBodyGetLinearVel(body()), *q = dBodyGetQuaternion(body());
        const Wanted wanted = wanted_motion();
        const Vector forward = axis(body(), 0);
        // Coulomb friction needs |change| / a to change the speed; on average the change comes half that late.
        const double change = wanted.speed - (v[0] * forward[0] + v[1] * forward[1]);
        const double late = std::abs(change) / (traction_limit(scene_) / scene_.robot.mass) / 2;
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
        forward_share_ = sideways_share_ = 0;
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
        const double both = scene_.physics.wheel_friction * scene_.robot.mass * scene_.physics.gravity;
        return both * scene_.robot.axle_length / 2 / robot_inertia(scene_.robot).vertical;
    }

    // What the wheels carry [N]. Friction at the floor tips the robot, whose weight and all that pushes it act at the
    // height of its centre of mass: forward friction loads a caster, friction to a side the wheel on the other one.
    std::array<double, 2> wheel_loads() const {
        const double mu = scene_.physics.wheel_friction, height = scene_.robot.centre_of_mass;
        const double both = scene_.robot.mass * scene_.physics.gravity /
                            (1 + mu * std::abs(forward_share_) * height / scene_.robot.caster_offset);
        const double shift = mu * sideways_share_ * height / scene_.robot.axle_length;
        return {both * (0.5 - shift), both * (0.5 + shift)};
    }

    void note_forces() {
        if (full_grip_ <= 0) return;  // it coasted or rested
        const Vector x = axis(body(), 0);
        const double fx = feedback_[left].f1[0] + feedback_[right].f1[0];
        const double fy = feedback_[left].f1[1] + feedback_[right].f1[1];
        forward_share_ = (fx * x[0] + fy * x[1]) / full_grip_;
        sideways_share_ = (fy * x[0] - fx * x[1]) / full_grip_;
        full_grip_ = 0;
    }

    // About the vertical in the coming step [rad/s]: as the wheels will turn it, or as a robot in a crowd turns.
    double turning_rate(bool is_free) const {
        return is_free ? wanted_motion().turning : dBodyGetAngularVel(body())[2];
    }

    std::array<dJointFeedback, 2> feedback_{};  // of the wheels' contacts
    double full_grip_ = 0;                      // of both wheels in the step that is taken [N]
    // Forces of both wheels in the last step over their full grip.
    double forward_share_ = 0, sideways_share_ = 0;
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
        loads_.fill(robot.mass * scene.physics.gravity / 2);
    }

    void set_rim_speeds(double left_speed, double right_speed) override {
        FloorDrive::set_rim_speeds(left_speed, right_speed);
        for (const Side side : {left, right})
            dJointSetHingeParam(hinges_[side], dParamVel, rim_speeds_[side] / scene_.robot.wheel_radius);
    }

    Vector intended_velocity() const override {
        if (has_fallen()) return {0, 0, 0};
        const Vector forward = level_of(body()).forward;
        const double speed = (rim_speeds_[left] + rim_speeds_[right]) / 2;
        return {speed * forward[0], speed * forward[1], 0};
    }

    void add_floor_contacts(Contacts& contacts, double, bool) override {
        if (has_fallen()) return add_fallen_contact(contacts);
        const double mu = scene_.physics.wheel_friction;
        for (const Side side : {left, right}) {
            const dBodyID wheel = bodies_[1 + side];
            const Foot foot = foot_of(wheel);
            const Grip& grip = grips_[side];
            const dJointID joint = contacts.add(wheel, nullptr, foot.point, kUp, foot.point[2],
                                                {foot.forward, mu * grip.along(), mu * grip.across(), 0, loads_[side]});
            dJointSetFeedback(joint, &feedback_[side]);
        }
        const Vector forward = level_of(body()).forward;
        for (const int end : {1, -1}) add_caster_contact(contacts, end, forward);
    }

    void finish(double time_step) override {
        if (has_fallen()) return;
        for (const Side side : {left, right}) {
            const Foot foot = foot_of(bodies_[1 + side]);
            const Vector& x = foot.forward;
            dVector3 v;
            dBodyGetPointVel(bodies_[1 + side], foot.point[0], foot.point[1], foot.point[2], v);
            grips_[side].note_slip(v[0] * x[0] + v[1] * x[1], v[1] * x[0] - v[0] * x[1], time_step);
            loads_[side] = std::fmax(0, feedback_[side].f1[2]);
        }
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
    std::array<dJointFeedback, 2> feedback_{};  // of the wheels' contacts with the floor
    std::array<double, 2> loads_;               // on the wheels in the last step [N]
    double chassis_centre_ = 0;
};

}  // namespace

std::unique_ptr<Drive> create_drive(const Scene& scene, dWorldID world, const Pose& start) {
    if (scene.physics.drive == SWE_DRIVE_ARTICULATED) return std::make_unique<Articulated>(scene, world, start);
    return std::make_unique<DrivenContacts>(scene, world, start);
}

}  // namespace swarmevo

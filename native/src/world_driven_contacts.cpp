// SPDX-License-Identifier: BSD-3-Clause
// The robot as one level body: Drive's fast model.
#include <algorithm>
#include <array>
#include <cmath>

#include "world_drive.hpp"

namespace swarmevo {
namespace {

// A wheel that slipped faster than this is assumed to go on [m/s].
constexpr double kSureSlip = 0.01;

// Turned about the vertical.
Vector turned(const Vector& direction, double angle) {
    const double c = std::cos(angle), s = std::sin(angle);
    return {c * direction[0] - s * direction[1], s * direction[0] + c * direction[1], 0};
}

class DrivenContacts : public Drive {
  public:
    DrivenContacts(const Scene& scene, dWorldID world, const Pose& start) : Drive(scene) {
        bodies_ = {create_level_body(world, {start.x, start.y, scene.robot.centre_of_mass}, start.heading,
                                     scene.robot.mass, robot_inertia(scene.robot).vertical)};
    }

    Vector intended_velocity() const override {
        const Vector forward = axis(body(), 0);
        const double speed = wanted_motion().speed;
        return {speed * forward[0], speed * forward[1], 0};
    }

    void forget() override {
        full_grip_ = 0;
        given_ = {};
    }

    void add_floor_contacts(Contacts& contacts, double time_step, bool is_free) override {
        // Wheels where they are and as they point in the middle of the step: its start would bend every curve outwards.
        rolling_ = turned(axis(body(), 0), turning_rate(is_free) * time_step / 2);
        const double mu = scene_.physics.wheel_friction;
        const std::array<double, 2> loads = wheel_loads();
        dBodySetForce(body(), 0, 0, 0);
        dBodySetTorque(body(), 0, 0, 0);
        for (const Side side : {left, right}) {
            const double along = mu * grips_[side].along() * (side == left ? 1 + kTieBreak : 1);
            add_wheel(contacts, side, {rolling_, along, 0, rim_speeds_[side], loads[side]});
        }
        // Both wheels resist a slide along their common axle, which goes through the middle.
        const double across = mu * (grips_[left].across() * loads[left] + grips_[right].across() * loads[right]);
        across_ = {};
        if (across > 0) dJointSetFeedback(contacts.add_brake(body(), {-rolling_[1], rolling_[0], 0}, across), &across_);
        full_grip_ = mu * (loads[left] + loads[right]);
    }

    bool slips_as_assumed() override {
        if (full_grip_ <= 0) return true;
        bool holds = true;
        const dReal* v = dBodyGetLinearVel(body());
        const double across = v[1] * rolling_[0] - v[0] * rolling_[1];
        for (const Side side : {left, right}) {
            const double along = slip_along(side, rolling_);
            const bool goes_on = !(given_[side] * along > 0);  // nor if it is no number: fold_state() finds that
            doubts_ |= !goes_on;
            holds &= goes_on && !grips_[side].leapt(along, across);
        }
        return holds;
    }

    void finish(double time_step) override {
        note_forces();
        const Vector x = axis(body(), 0);
        const dReal* v = dBodyGetLinearVel(body());
        for (const Side side : {left, right}) {
            const double slip = slip_along(side, x);
            slip_change_[side] = std::abs(slip - last_slip_[side]);
            last_slip_[side] = slip;
            grips_[side].note_slip(last_slip_[side], v[1] * x[0] - v[0] * x[1], time_step);
        }
        doubts_ = false;
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
        if (whole <= 0) return false;
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
        const double arc = wanted.speed * time_step - change * late;
        const double way = turn == 0 ? arc : arc * std::sin(turn / 2) / (turn / 2);  // the arc's chord

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

    // Of a wheel over the floor, along the direction in which it rolls [m/s].
    double slip_along(Side side, const Vector& rolling) const {
        const dReal* v = dBodyGetLinearVel(body());
        const double turning = dBodyGetAngularVel(body())[2];
        return v[0] * rolling[0] + v[1] * rolling[1] - turning * wheel_centre(scene_.robot, side)[1] -
               rim_speeds_[side];
    }

    void add_wheel(Contacts& contacts, Side side, Friction friction) {
        along_[side] = {};
        given_[side] = 0;
        const dReal* centre = dBodyGetPosition(body());
        const double y = wheel_centre(scene_.robot, side)[1];
        const double at_x = centre[0] - y * rolling_[1], at_y = centre[1] + y * rolling_[0];
        if (goes_on_slipping(side)) {
            given_[side] = (last_slip_[side] > 0 ? -1 : 1) * friction.along * friction.load;
            dBodyAddForceAtPos(body(), given_[side] * rolling_[0], given_[side] * rolling_[1], 0, at_x, at_y,
                               centre[2]);
            friction.along = 0;
        }
        if (friction.along > 0) dJointSetFeedback(contacts.add_level(body(), at_x, at_y, friction), &along_[side]);
    }

    // It slipped after the last step, faster than that changed, and the present command of its motor leaves that so.
    bool goes_on_slipping(Side side) const {
        const double then = last_slip_[side], now = slip_along(side, rolling_);
        return !doubts_ && then * now > 0 && std::min(std::abs(then), std::abs(now)) > kSureSlip + slip_change_[side];
    }

    void note_forces() {
        if (full_grip_ <= 0) return;  // it coasted or rested
        const double given = given_[left] + given_[right];
        const double fx = across_.f1[0] + along_[left].f1[0] + along_[right].f1[0] + given * rolling_[0];
        const double fy = across_.f1[1] + along_[left].f1[1] + along_[right].f1[1] + given * rolling_[1];
        forward_share_ = (fx * rolling_[0] + fy * rolling_[1]) / full_grip_;
        sideways_share_ = (fy * rolling_[0] - fx * rolling_[1]) / full_grip_;
        full_grip_ = 0;
    }

    // About the vertical in the coming step [rad/s]: as the wheels will turn it, or as a robot in a crowd turns.
    double turning_rate(bool is_free) const {
        return is_free ? wanted_motion().turning : dBodyGetAngularVel(body())[2];
    }

    Vector rolling_{};                       // direction in which the wheels roll in the step that is taken
    std::array<dJointFeedback, 2> along_{};  // what the wheels' contacts did in it
    dJointFeedback across_{};                // and their friction along the axle
    std::array<double, 2> given_{};          // forces along `rolling_` that were assumed in it [N]
    std::array<double, 2> last_slip_{};      // along, after the last step [m/s]
    std::array<double, 2> slip_change_{};    // in it [m/s]
    bool doubts_ = false;                    // an assumption of this step was wrong
    double full_grip_ = 0;                   // of both wheels in the step that is taken [N]
    // Forces of both wheels in the last step over their full grip.
    double forward_share_ = 0, sideways_share_ = 0;
};

}  // namespace

std::unique_ptr<Drive> create_driven_contacts(const Scene& scene, dWorldID world, const Pose& start) {
    return std::make_unique<DrivenContacts>(scene, world, start);
}

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
// The robot as one level body: Drive's fast model.
#include <algorithm>
#include <array>
#include <cmath>

#include "world/compliant.hpp"
#include "world/drive.hpp"

namespace swarmevo {
namespace {

class DrivenContacts : public Drive {
  public:
    DrivenContacts(const Scene& scene, dWorldID world, const Pose& start) : Drive(scene) {
        bodies_ = {create_level_body(world, {start.x, start.y, scene.robot.centre_of_mass}, start.heading,
                                     scene.robot.mass, robot_inertia(scene.robot).vertical)};
    }

    Twist intended_motion() const override {
        const Vector forward = axis(body(), 0);
        const Wanted wanted = wanted_motion();
        return {wanted.speed * forward[0], wanted.speed * forward[1], wanted.turning};
    }

    void add_to(CompliantStep& step, const Place& place) override {
        lay_out(place);
        for (const Side side : {left, right}) step.add_rub(rubs_[side], foot_of(side), surface_of(side));
    }

    void add_to(Contacts& contacts, const Place& place) override {
        lay_out(place);
        dBodySetForce(body(), 0, 0, 0);
        dBodySetTorque(body(), 0, 0, 0);
        for (const Side side : {left, right}) {
            const Vector foot = foot_of(side);
            rubs_[side].add(contacts, body(), place.x + foot[0], place.y + foot[1], surface_of(side));
        }
    }

    bool share_loads(const double (&forces)[2][2]) override {
        const double full_grip = rubs_[left].limit() + rubs_[right].limit();
        if (full_grip <= 0) return false;
        const double fx = forces[left][0] + forces[right][0], fy = forces[left][1] + forces[right][1];
        // What a solver asked for beyond it is not to be had.
        const double whole = std::max(full_grip, norm(fx, fy));
        forward_share_ = (fx * rolling_[0] + fy * rolling_[1]) / whole;
        sideways_share_ = (fy * rolling_[0] - fx * rolling_[1]) / whole;
        return set_limits();
    }

    bool fits() override {
        double forces[2][2];
        for (const Side side : {left, right}) {
            const Vector force = rubs_[side].force(slip(side));
            forces[side][0] = force[0];
            forces[side][1] = force[1];
        }
        const double before[2] = {rubs_[left].limit(), rubs_[right].limit()};
        share_loads(forces);
        bool all = true;
        for (const Side side : {left, right}) {
            const double limit = rubs_[side].limit();
            rubs_[side].set_limit(before[side]);
            all &= rubs_[side].fits(slip(side), limit);
        }
        return all;
    }

    void finish() override {
        for (const Side side : {left, right}) {
            const Vector force = rubs_[side].force(slip(side));
            rubs_[side].remember(force[0], force[1]);
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
        // What it slides sideways is to stop, and the curve to be held.
        const double sideways =
            m * (std::abs(v[0] * y[0] + v[1] * y[1]) / time_step + std::abs(wanted.speed * wanted.turning));
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
        const Vector after_turn = turned(forward, turn);
        dBodySetLinearVel(body(), wanted.speed * after_turn[0], wanted.speed * after_turn[1], 0);
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

    // Of a wheel's foot over the floor [m/s].
    Vector slip(Side side) const {
        const dReal* v = dBodyGetLinearVel(body());
        const double turning = dBodyGetAngularVel(body())[2], y = wheel_centre(scene_.robot, side)[1];
        const double faster = rim_speeds_[side] + turning * y;  // than the body's middle
        return {v[0] - faster * rolling_[0], v[1] - faster * rolling_[1], 0};
    }

    void lay_out(const Place& place) {
        rolling_ = place.forward();
        if (!expects_) return;
        expects_ = false;
        for (const Side side : {left, right}) rubs_[side].expect(rubs_[side].limit(), rolling_, slip(side));
        set_limits();
    }

    // True if they are others.
    bool set_limits() {
        const std::array<double, 2> loads = wheel_loads();
        bool changed = false;
        for (const Side side : {left, right}) {
            const double limit = scene_.physics.wheel_friction * loads[side];
            changed |= limit != rubs_[side].limit();
            rubs_[side].set_limit(limit);
        }
        return changed;
    }

    // From the body's middle [m].
    Vector foot_of(Side side) const {
        const double y = wheel_centre(scene_.robot, side)[1];
        return {-y * rolling_[1], y * rolling_[0], 0};
    }

    // Velocity at which its rim rolls [m/s].
    Vector surface_of(Side side) const { return {rim_speeds_[side] * rolling_[0], rim_speeds_[side] * rolling_[1], 0}; }

    Vector rolling_{};  // direction in which the wheels roll in the step that is taken
    // Forces of both wheels in the last step over their full grip.
    double forward_share_ = 0, sideways_share_ = 0;
};

}  // namespace

std::unique_ptr<Drive> create_driven_contacts(const Scene& scene, dWorldID world, const Pose& start) {
    return std::make_unique<DrivenContacts>(scene, world, start);
}

}  // namespace swarmevo

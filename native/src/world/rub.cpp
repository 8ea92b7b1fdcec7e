// SPDX-License-Identifier: BSD-3-Clause
#include "world/rub.hpp"

#include <algorithm>
#include <cmath>

namespace swarmevo {

void Rub::expect(double limit, const Vector& axis, const Vector& slip) {
    limit_ = limit;
    axis_ = axis;
    last_x_ = along_ * axis[0] - across_ * axis[1];
    last_y_ = along_ * axis[1] + across_ * axis[0];
    guess(slip);
}

void Rub::remember(double fx, double fy) {
    along_ = fx * axis_[0] + fy * axis_[1];
    across_ = fy * axis_[0] - fx * axis_[1];
}

Rub::Law Rub::law(double slip_x, double slip_y) const {
    const double stiffness = limit_ / kStickSlip;
    const double fx = last_x_ - stiffness * slip_x, fy = last_y_ - stiffness * slip_y;
    const double strength = norm(fx, fy);
    if (strength <= limit_) return {fx, fy, stiffness, 0, stiffness};
    const double ux = fx / strength, uy = fy / strength, across = stiffness * limit_ / strength;
    return {limit_ * ux, limit_ * uy, across * uy * uy, -across * ux * uy, across * ux * ux};
}

// ---- for ODE ----

void Rub::guess(const Vector& slip) {
    speed_ = norm(slip[0], slip[1]);
    if (speed_ > 0) direction_ = {slip[0] / speed_, slip[1] / speed_, 0};
}

double Rub::drag() const {
    return limit_ / std::max(speed_, kCreep);
}

Friction Rub::rows(const Vector& surface) const {
    Friction friction{direction_, limit_, dInfinity, 0};
    friction.load = 1;
    friction.surface_speed = surface[0] * direction_[0] + surface[1] * direction_[1];
    friction.surface_speed_across = surface[1] * direction_[0] - surface[0] * direction_[1];
    friction.slip_along = kCreep / limit_;
    friction.slip_across = 1 / drag();
    return friction;
}

void Rub::add(Contacts& contacts, dBodyID body, double x, double y, const Vector& surface) {
    if (limit_ > 0) contacts.add_level(body, x, y, rows(surface));
}

void Rub::add_pressed(Contacts& contacts, dBodyID body, const Vector& point, double gap) {
    const Friction friction = limit_ > 0 ? rows({}) : Friction{direction_, 0, 0, 0};
    dJointSetFeedback(contacts.add(body, nullptr, point, {0, 0, 1}, gap, friction), &rows_);
}

Vector Rub::force(const Vector& slip) const {
    const double along = slip[0] * direction_[0] + slip[1] * direction_[1];
    const double across = slip[1] * direction_[0] - slip[0] * direction_[1];
    const double f = -limit_ * std::clamp(along / kCreep, -1.0, 1.0), g = -drag() * across;
    return {f * direction_[0] - g * direction_[1], f * direction_[1] + g * direction_[0], 0};
}

bool Rub::fits(const Vector& slip, double limit) {
    const Vector found = force(slip);
    const double speed = std::max(norm(slip[0], slip[1]), kCreep), strength = norm(found[0], found[1]);
    const double error = norm(found[0] + limit * slip[0] / speed, found[1] + limit * slip[1] / speed);
    const bool is_too_strong = strength > (1 + kRubError) * limit;
    // An error is as much as the slip being another by this share.
    const bool is_wrong = error > kRubError * limit && error * speed > kSlightSlip * limit;
    if (!is_too_strong && !is_wrong) return true;  // nor if it is no number: fold_state() finds that
    limit_ = limit;
    // Near sticking, guesses would jump from side to side of the force that is asked for, which hardly changes.
    const bool turned = slip[0] * direction_[0] + slip[1] * direction_[1] < kLargeTurn * speed;
    if (turned && strength > 0) {
        const Vector u = {-found[0] / strength, -found[1] / strength, 0};
        const double along = std::max(slip[0] * u[0] + slip[1] * u[1], kCreep);
        guess({along * u[0], along * u[1], 0});
    } else {
        guess(slip);
    }
    return false;
}

}  // namespace swarmevo

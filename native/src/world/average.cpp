// SPDX-License-Identifier: BSD-3-Clause
#include "world/average.hpp"

#include <algorithm>
#include <cmath>

#include "world/constants.hpp"

namespace swarmevo {

int AverageVelocity::add_body(dBodyID body, const Limits& limits) {
    bodies_.push_back({body, limits, {}, {}, {}, {}, {}, {}, {}, false, false});
    return static_cast<int>(bodies_.size()) - 1;
}

AverageVelocity::Motion AverageVelocity::motion_of(dBodyID body) {
    const dReal* v = dBodyGetLinearVel(body);
    return {v[0], v[1], dBodyGetAngularVel(body)[2]};
}

void AverageVelocity::begin(double time_step, bool cautious) {
    time_step_ = time_step;
    cautious_ = cautious;
    touches_.clear();
    to_check_.clear();
    for (Body& body : bodies_) {
        body.before = body.intended = motion_of(body.id);
        body.in_touch = false;
        std::copy_n(dBodyGetPosition(body.id), 3, body.start.begin());
        std::copy_n(dBodyGetQuaternion(body.id), 4, body.start_turn);
        const Motion& v = body.before;
        const dReal* r = dBodyGetRotation(body.id);
        body.end = {body.start[0], body.start[1], r[0], r[4]};
        if (!drifts_) continue;
        body.end.x += v.x * time_step;
        body.end.y += v.y * time_step;
        if (v.spin == 0) continue;
        const double c = std::cos(v.spin * time_step), s = std::sin(v.spin * time_step);
        body.end.cosine = r[0] * c - r[4] * s;
        body.end.sine = r[4] * c + r[0] * s;
    }
}

void AverageVelocity::place_body(int number) const {
    const Body& body = bodies_[number];
    const Motion& v = body.before;
    if (drifts_) move(body, {v.x * time_step_, v.y * time_step_, v.spin * time_step_});
}

void AverageVelocity::intend(int body, double x, double y) {
    bodies_[body].intended = {x, y, bodies_[body].before.spin};
}

// Speed at which two surfaces near each other [m/s], with one of their bodies' motions.
double AverageVelocity::approach(const Touch& touch, Motion Body::*when) const {
    double speed = 0;
    for (const int number : {touch.first, touch.second}) {
        if (number == kWall) continue;
        const Body& body = bodies_[number];
        const Motion& motion = body.*when;
        const double vx = motion.x - motion.spin * (touch.y - body.end.y);
        const double vy = motion.y + motion.spin * (touch.x - body.end.x);
        const double along = vx * touch.normal_x + vy * touch.normal_y;
        speed += number == touch.first ? -along : along;
    }
    return speed;
}

bool AverageVelocity::note(Touch& touch) {
    touch.closing = approach(touch, &Body::before);
    if (drifts_) touch.gap += touch.closing * time_step_;
    speed_ = std::fmax(touch.closing, approach(touch, &Body::intended));
    const bool likely = cautious_ || may_close(touch.gap);
    (likely ? touches_ : to_check_).push_back(touch);
    return likely;
}

bool AverageVelocity::may_close(double gap) const {
    return cautious_ || gap - kSlack <= (speed_ + kPushAllowance) * time_step_;
}

void AverageVelocity::read_velocities() {
    for (Body& body : bodies_) body.now = dBodyIsEnabled(body.id) ? motion_of(body.id) : body.intended;
}

bool AverageVelocity::kept_clear() const {
    return std::none_of(to_check_.begin(), to_check_.end(), [&](const Touch& touch) {
        return approach(touch, &Body::now) * time_step_ > touch.gap + (touch.travel > 0 ? kUnnoticedOverlap : 0);
    });
}

double AverageVelocity::until_impact() const {
    double share = 1;
    for (const Touch& touch : touches_) {
        if (touch.gap <= kContactGap || touch.travel <= 0) continue;
        const double closed = (touch.closing + approach(touch, &Body::now)) / 2 * time_step_;
        if (closed > touch.gap + kImpactDepth) share = std::fmin(share, touch.gap / closed);
    }
    return share;
}

double AverageVelocity::error() const {
    double largest = 0;
    for (const Touch& touch : touches_) {
        const double left = touch.gap - approach(touch, &Body::now) * time_step_;
        if (left > kContactGap) continue;  // it still leaves a gap
        // Bumpers that are pressed in change their force within the step.
        const double pressed = std::abs(std::fmin(touch.gap, 0) - std::fmin(left, 0));
        const double recoil = touch.recoil * pressed * time_step_ / 2;
        for (const int number : {touch.first, touch.second}) {
            if (number == kWall) continue;
            const Body& body = bodies_[number];
            const double change = norm(body.now.x - body.before.x, body.now.y - body.before.y);
            const double turn = std::abs(body.now.spin - body.before.spin) * body.limits.reach;
            largest = std::fmax(largest, (change + turn + recoil) * time_step_ / 2);
        }
    }
    return largest;
}

void AverageVelocity::apply() {
    for (const Touch& touch : touches_) {
        if (touch.gap - approach(touch, &Body::now) * time_step_ > kContactGap) continue;
        bodies_[touch.first].in_touch = true;
        if (touch.second != kWall) bodies_[touch.second].in_touch = true;
    }
    for (Body& body : bodies_) body.missing = missing_way(body);
    for (const Touch& touch : touches_) keep_apart(touch);
    for (const Body& body : bodies_)
        if (dBodyIsEnabled(body.id))
            move(body, {body.now.x * time_step_ + body.missing.x, body.now.y * time_step_ + body.missing.y,
                        body.now.spin * time_step_ + body.missing.spin});
}

void AverageVelocity::settle() {
    for (Body& body : bodies_) {
        const Motion now = motion_of(body.id);
        const double change = norm(now.x - body.before.x, now.y - body.before.y);
        const double turn = std::abs(now.spin - body.before.spin);
        body.settled = norm(now.x, now.y) < kRestingSpeed && std::abs(now.spin) < kRestingSpin &&
                       change * kSettling < kRestingSpeed * time_step_ && turn * kSettling < kRestingSpin * time_step_;
    }
}

// What ODE left out of a body's way [m], [rad].
AverageVelocity::Motion AverageVelocity::missing_way(const Body& body) const {
    if (!dBodyIsEnabled(body.id)) return {0, 0, 0};
    const double dx = body.now.x - body.before.x, dy = body.now.y - body.before.y;
    const double change = norm(dx, dy), turn = body.now.spin - body.before.spin;
    // The mean times at which the velocities changed.
    double time = time_step_ / 2, spin_time = time_step_ / 2;
    if (!body.in_touch) {
        time = std::fmin(time, change / body.limits.linear / 2);
        spin_time = std::fmin(spin_time, std::abs(turn) / body.limits.angular / 2);
    }
    return {-dx * time, -dy * time, -turn * spin_time};
}

// Gives up the missing ways of two bodies where they would lead into something rigid.
void AverageVelocity::keep_apart(const Touch& touch) {
    const double closed = approach(touch, &Body::missing), left = touch.gap - approach(touch, &Body::now) * time_step_;
    if (closed <= kContactGap || left + touch.travel >= closed) return;
    for (const int number : {touch.first, touch.second})
        if (number != kWall) bodies_[number].missing = {0, 0, 0};
}

// From the start of the step.
void AverageVelocity::move(const Body& body, const Motion& way) {
    dBodySetPosition(body.id, body.start[0] + way.x, body.start[1] + way.y, body.start[2]);
    dQuaternion turn, turned;
    dQFromAxisAndAngle(turn, 0, 0, 1, way.spin);
    dQMultiply0(turned, turn, body.start_turn);
    dBodySetQuaternion(body.id, turned);
}

}  // namespace swarmevo

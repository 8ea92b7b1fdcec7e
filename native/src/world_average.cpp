// SPDX-License-Identifier: BSD-3-Clause
#include "world_average.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace swarmevo {
namespace {

// Velocity changes below these are left as they are [m/s], [rad/s].
constexpr double kSlightChange = 1e-7, kSlightTurn = 1e-6;
// Bodies this near to each other touch [m]; if they then near each other faster than this, they collide [m/s].
constexpr double kContactGap = 1e-5, kGentle = 0.01;
// A body slower than this [m/s], [rad/s], that would take longer than this to gain as much [s], has settled.
constexpr double kRestingSpeed = 2e-5, kRestingSpin = 2e-4, kSettling = 0.1;
// Speed that others hardly give a body within a step, beyond what it does and means to do, and that they may [m/s].
constexpr double kShove = 0.1, kUsualShove = 0.02;
// Gap that may be closed in any step, however short [m].
constexpr double kSlack = 1e-4;
constexpr double kNever = std::numeric_limits<double>::infinity();

}  // namespace

void AverageVelocity::add_body(dBodyID body, const Limits& limits) {
    bodies_.push_back({body, limits, {}, {}, {}, {}, 0, false, false, false});
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
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
        Body& body = bodies_[i];
        body.before = body.intended = motion_of(body.id);
        body.group = static_cast<int>(i);
        body.in_touch = body.collides = false;
    }
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
        const dReal* centre = dBodyGetPosition(body.id);
        const double vx = motion.x - motion.spin * (touch.y - centre[1]);
        const double vy = motion.y + motion.spin * (touch.x - centre[0]);
        const double along = vx * touch.normal_x + vy * touch.normal_y;
        speed += number == touch.first ? -along : along;
    }
    return speed;
}

AverageVelocity::Meeting AverageVelocity::note(const Touch& touch) {
    const double speed = std::fmax(approach(touch, &Body::before), approach(touch, &Body::intended));
    const double shove = (touch.gap - kSlack) / time_step_ - speed;  // what it would take
    const Meeting meeting = cautious_ || shove <= kUsualShove ? Meeting::likely
                            : shove <= kShove                 ? Meeting::unlikely
                                                              : Meeting::far;
    if (meeting != Meeting::far) touches_.push_back(touch);
    if (meeting != Meeting::likely) to_check_.push_back(touch);
    return meeting;
}

bool AverageVelocity::kept_clear() {
    for (Body& body : bodies_) body.now = dBodyIsEnabled(body.id) ? motion_of(body.id) : body.intended;
    return std::none_of(to_check_.begin(), to_check_.end(),
                        [&](const Touch& touch) { return approach(touch, &Body::now) * time_step_ > touch.gap; });
}

// When in the step bodies collide [s]. Only if they both move towards each other and mean to: one that is about to stop
// or turn back will not arrive.
double AverageVelocity::collision_time(const Touch& touch) const {
    const double speed = std::fmin(approach(touch, &Body::before), approach(touch, &Body::intended));
    if (speed <= kGentle) return kNever;
    if (touch.gap <= kContactGap) return 0;
    return speed * time_step_ > touch.gap ? touch.gap / speed : kNever;
}

double AverageVelocity::first_collision() const {
    double first = kNever;
    for (const Touch& touch : touches_) first = std::fmin(first, collision_time(touch));
    return first;
}

int AverageVelocity::root(int body) const {
    while (bodies_[body].group != body) body = bodies_[body].group;
    return body;
}

// Puts two bodies that touched in this step into one group.
void AverageVelocity::join(const Touch& touch) {
    if (touch.gap - approach(touch, &Body::now) * time_step_ > kContactGap) return;  // it still leaves a gap
    const bool collides = touch.gap > kContactGap || approach(touch, &Body::before) > kGentle;
    const int first = root(touch.first), second = touch.second == kWall ? first : root(touch.second);
    bodies_[touch.first].in_touch = true;
    if (touch.second != kWall) bodies_[touch.second].in_touch = true;
    bodies_[first].collides |= collides || bodies_[second].collides;
    bodies_[second].group = first;
}

void AverageVelocity::apply() {
    for (Body& body : bodies_) body.now = motion_of(body.id);
    for (const Touch& touch : touches_) join(touch);
    for (std::size_t i = 0; i < bodies_.size(); ++i)
        bodies_[i].missing = bodies_[root(static_cast<int>(i))].collides ? Motion{0, 0, 0} : missing_way(bodies_[i]);
    while (keep_apart()) continue;
    for (const Body& body : bodies_)
        if (body.missing.x != 0 || body.missing.y != 0 || body.missing.spin != 0) move(body);
}

void AverageVelocity::settle() {
    for (Body& body : bodies_) {
        const Motion now = motion_of(body.id);
        const double change = std::hypot(now.x - body.before.x, now.y - body.before.y);
        const double turn = std::abs(now.spin - body.before.spin);
        body.settled = std::hypot(now.x, now.y) < kRestingSpeed && std::abs(now.spin) < kRestingSpin &&
                       change * kSettling < kRestingSpeed * time_step_ && turn * kSettling < kRestingSpin * time_step_;
    }
}

// What ODE left out of a body's way [m], [rad].
AverageVelocity::Motion AverageVelocity::missing_way(const Body& body) const {
    const double dx = body.now.x - body.before.x, dy = body.now.y - body.before.y;
    const double change = std::hypot(dx, dy), turn = body.now.spin - body.before.spin;
    if (change < kSlightChange && std::abs(turn) < kSlightTurn) return {0, 0, 0};
    // The mean times at which the velocities changed.
    double time = time_step_ / 2, spin_time = time_step_ / 2;
    if (!body.in_touch) {
        time = std::fmin(time, change / body.limits.linear / 2);
        spin_time = std::fmin(spin_time, std::abs(turn) / body.limits.angular / 2);
    }
    return {-dx * time, -dy * time, -turn * spin_time};
}

// Gives up a group's missing way where it would lead into something. True if there was such a group.
bool AverageVelocity::keep_apart() {
    bool gave_up = false;
    for (const auto* touches : {&touches_, &to_check_})
        for (const Touch& touch : *touches) {
            const double closed = approach(touch, &Body::missing);
            if (closed <= kContactGap || touch.gap - approach(touch, &Body::now) * time_step_ >= closed) continue;
            for (const int number : {touch.first, touch.second})
                if (number != kWall && !bodies_[root(number)].collides) gave_up = bodies_[root(number)].collides = true;
        }
    if (gave_up)
        for (std::size_t i = 0; i < bodies_.size(); ++i)
            if (bodies_[root(static_cast<int>(i))].collides) bodies_[i].missing = {0, 0, 0};
    return gave_up;
}

void AverageVelocity::move(const Body& body) {
    const dReal *p = dBodyGetPosition(body.id), *q = dBodyGetQuaternion(body.id);
    dBodySetPosition(body.id, p[0] + body.missing.x, p[1] + body.missing.y, p[2]);
    dQuaternion turn, turned;
    dQFromAxisAndAngle(turn, 0, 0, 1, body.missing.spin);
    dQMultiply0(turned, turn, q);
    dBodySetQuaternion(body.id, turned);
}

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
#include "world_box.hpp"

#include <algorithm>
#include <cmath>

namespace swarmevo {
namespace {

// Below this speed friction acts along the box's edges, above along its motion [m/s].
constexpr double kSlidingSpeed = 1e-3;
// Corners that slide faster than this are assumed to go on [m/s].
constexpr double kSureSlide = 0.02;
// A wall this near is touched [m].
constexpr double kTouchingGap = 1e-6;

}  // namespace

Box::Box(const Scene& scene, dWorldID world)
    : scene_(scene),
      reach_(std::hypot(scene.box.size[0], scene.box.size[1]) / 2),
      half_height_(scene.box.size[2] / 2),
      corner_limit_(scene.physics.box_friction * scene.box.mass * scene.physics.gravity / kCorners),
      is_level_(scene.physics.drive == SWE_DRIVE_DRIVEN_CONTACTS) {
    const swe_box_config& b = scene.box;
    dMass mass;
    dMassSetBoxTotal(&mass, b.mass, b.size[0], b.size[1], b.size[2]);
    const Vector centre = {b.pose[0], b.pose[1], half_height_};
    body_ = is_level_ ? create_level_body(world, centre, b.pose[2], b.mass, mass.I[10])
                      : create_body(world, centre, b.pose[2], 0, mass);
    dBodySetLinearVel(body_, b.velocity[0], b.velocity[1], 0);
    dBodySetAngularVel(body_, 0, 0, b.velocity[2]);
}

// A foot of the body, in its own frame [m].
Vector Box::foot(int number) const {
    return {(number & 1 ? 0.5 : -0.5) * scene_.box.size[0], (number & 2 ? 0.5 : -0.5) * scene_.box.size[1],
            -half_height_};
}

Vector Box::corner(int number) const {
    const Vector local = foot(number);
    const dReal* r = dBodyGetRotation(body_);
    return {r[0] * local[0] + r[1] * local[1], r[4] * local[0] + r[5] * local[1], 0};
}

void Box::assume(bool is_still) {
    const dReal* v = dBodyGetLinearVel(body_);
    const double speed = std::hypot(v[0], v[1]);
    direction_ = speed > kSlidingSpeed ? Vector{v[0] / speed, v[1] / speed, 0} : axis(body_, 0);
    assumed_ = Assumed::nothing;
    if (doubts_ || !is_level_ || corner_limit_ <= 0) return;
    if (is_still) assumed_ = Assumed::stands;
    if (speed > kSureSlide && slowest_corner() > kSureSlide) assumed_ = Assumed::slides;
}

void Box::add_floor_contacts(Contacts& contacts) {
    dBodySetForce(body_, 0, 0, 0);
    if (assumed_ == Assumed::slides) {
        // Four equal forces at the corners turn nothing.
        const double pull = -kCorners * corner_limit_;
        dBodyAddForce(body_, pull * direction_[0], pull * direction_[1], 0);
        across_ = turning_ = {};
        dJointSetFeedback(contacts.add_brake(body_, {-direction_[1], direction_[0], 0}, dInfinity), &across_);
        dJointSetFeedback(contacts.add_turning_brake(body_, dInfinity), &turning_);
        return;
    }
    for (int i = 0; i < kCorners; ++i) add_foot(contacts, i);
}

void Box::add_foot(Contacts& contacts, int number) const {
    const double mu = scene_.physics.box_friction * (1 + number * kTieBreak);
    if (!is_level_) {
        const Vector at = to_world(body_, foot(number));
        contacts.add(body_, nullptr, at, {0, 0, 1}, at[2], {direction_, mu, mu, 0});
    } else if (mu > 0) {
        const double load = scene_.box.mass * scene_.physics.gravity / kCorners;
        const dReal* middle = dBodyGetPosition(body_);
        const Vector to = corner(number);
        contacts.add_level(body_, middle[0] + to[0], middle[1] + to[1], {direction_, mu, mu, 0, load});
    }
}

bool Box::moved_as_assumed(const Load& load) {
    if (assumed_ == Assumed::stands) doubts_ = !floor_holds(load);
    if (assumed_ == Assumed::slides) doubts_ = !(slowest_corner() >= 0 && floor_holds_across());
    return !doubts_ || assumed_ == Assumed::nothing;
}

void Box::finish() {
    if (assumed_ == Assumed::stands) {
        dBodySetLinearVel(body_, 0, 0, 0);
        dBodySetAngularVel(body_, 0, 0, 0);
    }
    assumed_ = Assumed::nothing;
    doubts_ = false;
}

// Along the direction of the step [m/s].
double Box::slowest_corner() const {
    const dReal *v = dBodyGetLinearVel(body_), *w = dBodyGetAngularVel(body_);
    double largest_lever = 0;
    for (int i = 0; i < kCorners; ++i) {
        const Vector to = corner(i);
        largest_lever = std::max(largest_lever, to[0] * direction_[1] - to[1] * direction_[0]);
    }
    return v[0] * direction_[0] + v[1] * direction_[1] - std::abs(w[2]) * largest_lever;
}

// Can walls and friction along the edges keep the box where it is? Corners may share a force along an edge as they
// like, and what they have left of their limits, one end against the other, holds against a torque.
bool Box::floor_holds(Load load) const {
    if (load.x == 0 && load.y == 0 && load.torque == 0) return true;
    take_by_walls(load);
    const Vector x = axis(body_, 0), y = axis(body_, 1);
    const double left_x = kCorners * corner_limit_ - std::abs(load.x * x[0] + load.y * x[1]);
    const double left_y = kCorners * corner_limit_ - std::abs(load.x * y[0] + load.y * y[1]);
    return left_x >= 0 && left_y >= 0 &&
           std::abs(load.torque) <= left_x * scene_.box.size[1] / 2 + left_y * scene_.box.size[0] / 2;
}

// Takes away what presses on walls, and what torque they can hold against then.
void Box::take_by_walls(Load& load) const {
    const dReal* centre = dBodyGetPosition(body_);
    for (const Vector& out : {Vector{1, 0, 0}, Vector{-1, 0, 0}, Vector{0, 1, 0}, Vector{0, -1, 0}}) {
        const double press = load.x * out[0] + load.y * out[1];
        const double to_wall = scene_.arena.size / 2 - (centre[0] * out[0] + centre[1] * out[1]);
        double least = INFINITY, most = -INFINITY;  // where along the wall corners touch it [m]
        for (int i = 0; i < kCorners; ++i) {
            const Vector to = corner(i);
            if (to[0] * out[0] + to[1] * out[1] < to_wall - kTouchingGap) continue;
            least = std::min(least, to[1] * out[0] - to[0] * out[1]);
            most = std::max(most, to[1] * out[0] - to[0] * out[1]);
        }
        if (press <= 0 || least > most) continue;
        // A wall's force -press * out at `at` along the wall has the torque press * at.
        const double at = std::clamp(-load.torque / press, least, most);
        load.x -= press * out[0];
        load.y -= press * out[1];
        load.torque += press * at;
    }
}

// Can the corners do what the brakes did?
bool Box::floor_holds_across() const {
    const double force = across_.f1[1] * direction_[0] - across_.f1[0] * direction_[1], torque = turning_.t1[2];
    double most = 0, squares = 0;
    for (int i = 0; i < kCorners; ++i) {
        const Vector to = corner(i);
        const double ahead = to[0] * direction_[0] + to[1] * direction_[1];
        most = std::max(most, std::abs(ahead));
        squares += ahead * ahead;
    }
    return std::abs(force) / kCorners + std::abs(torque) * most / squares <= corner_limit_;
}

}  // namespace swarmevo

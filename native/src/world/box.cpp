// SPDX-License-Identifier: BSD-3-Clause
#include "world/box.hpp"

#include <algorithm>
#include <cmath>

#include "world/compliant.hpp"
#include "world/constants.hpp"

namespace swarmevo {
namespace {

// The limit curve is followed to this share of a load.
constexpr double kHoldPrecision = 1e-4;
// Speed at which a box whose feet give way is first expected to move [m/s].
constexpr double kFirstSpeed = 1e-3;

}  // namespace

Box::Box(const Scene& scene, dWorldID world)
    : scene_(scene),
      reach_(norm(scene.box.size[0], scene.box.size[1]) / 2),
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
    loads_.fill(b.mass * scene.physics.gravity / kCorners);
}

// A foot of the body, in its own frame [m].
Vector Box::foot(int number) const {
    return {(number & 1 ? 0.5 : -0.5) * scene_.box.size[0], (number & 2 ? 0.5 : -0.5) * scene_.box.size[1],
            -half_height_};
}

void Box::place_at(const Place& place) {
    place_ = place;
    for (int i = 0; i < kCorners; ++i) {
        const Vector local = foot(i);
        feet_[i] = place.turned(local[0], local[1]);
    }
    if (stands_ || !expects_) return;
    expect_slips(motion());
    expects_ = false;
}

Twist Box::motion() const {
    const dReal* v = dBodyGetLinearVel(body_);
    return {v[0], v[1], dBodyGetAngularVel(body_)[2]};
}

Vector Box::slip(int number, const Twist& motion) const {
    const Vector& to = feet_[number];
    return {motion.x - motion.spin * to[1], motion.y + motion.spin * to[0], 0};
}

void Box::expect_slips(const Twist& motion) {
    for (int i = 0; i < kCorners; ++i) {
        const double limit = is_level_ ? corner_limit_ : scene_.physics.box_friction * loads_[i];
        rubs_[i].expect(limit, place_.forward(), slip(i, motion));
    }
}

void Box::add_to(CompliantStep& step) {
    for (int i = 0; i < kCorners; ++i) step.add_rub(rubs_[i], feet_[i], {});
}

void Box::add_to(Contacts& contacts) {
    dBodySetForce(body_, 0, 0, 0);
    dBodySetTorque(body_, 0, 0, 0);
    for (int i = 0; i < kCorners; ++i) {
        if (is_level_) {
            rubs_[i].add(contacts, body_, place_.x + feet_[i][0], place_.y + feet_[i][1], {});
        } else {
            const Vector at = to_world(body_, foot(i));
            rubs_[i].add_pressed(contacts, body_, at, at[2]);
        }
    }
}

bool Box::fits() {
    bool all = true;
    if (is_level_)  // at the small steps of the reference the slip of the step before is a good guess
        for (int i = 0; i < kCorners; ++i) all &= rubs_[i].fits(slip(i, motion()), corner_limit_);
    return all;
}

void Box::finish(bool by_ode) {
    if (stands_) {
        dBodySetLinearVel(body_, 0, 0, 0);
        dBodySetAngularVel(body_, 0, 0, 0);
    } else if (!is_level_) {
        for (int i = 0; i < kCorners; ++i) loads_[i] = std::max(0.0, rubs_[i].load());
    } else if (by_ode) {
        for (int i = 0; i < kCorners; ++i) {
            const Vector force = rubs_[i].force(slip(i, motion()));
            rubs_[i].remember(force[0], force[1]);
        }
    }
}

bool Box::withstands(Load load) {
    take_by_walls(load);
    const Hold hold = hold_of(feet_, corner_limit_, load, kHoldPrecision);
    if (hold.factor >= 1) return true;
    stands_ = expects_ = false;
    const double speed = norm(hold.motion.x, hold.motion.y) + std::abs(hold.motion.spin) * reach_;
    const double scale = kFirstSpeed / speed;
    expect_slips({scale * hold.motion.x, scale * hold.motion.y, scale * hold.motion.spin});
    return false;
}

// Takes away what presses on walls, and what torque they can hold against then.
void Box::take_by_walls(Load& load) const {
    for (const Vector& out : {Vector{1, 0, 0}, Vector{-1, 0, 0}, Vector{0, 1, 0}, Vector{0, -1, 0}}) {
        const double press = load.x * out[0] + load.y * out[1];
        const double to_wall = scene_.arena.size / 2 - (place_.x * out[0] + place_.y * out[1]);
        double least = INFINITY, most = -INFINITY;  // where along the wall corners touch it [m]
        for (int i = 0; i < kCorners; ++i) {
            const Vector& to = corner(i);
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

}  // namespace swarmevo

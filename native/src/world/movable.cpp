// SPDX-License-Identifier: BSD-3-Clause
#include "world/movable.hpp"

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

Movable::Movable(const Scene& scene, const MovableKind& kind, dWorldID world, const Pose& start)
    : scene_(scene),
      kind_(kind),
      half_height_(kind.config.size[2] / 2),
      foot_limit_(kind.config.friction * kind.config.mass * scene.physics.gravity / kFeet),
      is_level_(scene.physics.drive == SWE_DRIVE_DRIVEN_CONTACTS) {
    const swe_movable_config& b = kind.config;
    dMass mass;
    if (kind.figure.is_round)
        dMassSetCylinderTotal(&mass, b.mass, 3, b.size[0] / 2, b.size[2]);
    else
        dMassSetBoxTotal(&mass, b.mass, b.size[0], b.size[1], b.size[2]);
    const Vector centre = {start.x, start.y, half_height_};
    body_ = is_level_ ? create_level_body(world, centre, start.heading, b.mass, mass.I[10])
                      : create_body(world, centre, start.heading, 0, mass);
    dBodySetLinearVel(body_, b.velocity[0], b.velocity[1], 0);
    dBodySetAngularVel(body_, 0, 0, b.velocity[2]);
    loads_.fill(b.mass * scene.physics.gravity / kFeet);
}

// Turning about the middle, friction on feet at the farthest points has half a diagonal as its lever.
AverageVelocity::Limits Movable::limits() const {
    const double reach = kind_.figure.reach, pull = kind_.config.friction * scene_.physics.gravity;
    const double gyration_squared = reach * reach / (kind_.figure.is_round ? 2 : 3);
    return {pull, pull * kind_.config.feet * reach / gyration_squared, reach};
}

// A foot of the body, in its own frame [m].
Vector Movable::foot(int number) const {
    const double x = (number & 1 ? 0.5 : -0.5) * kind_.config.size[0];
    const double y = (number & 2 ? 0.5 : -0.5) * kind_.config.size[1];
    const double share = kind_.config.feet * (kind_.figure.is_round ? std::sqrt(0.5) : 1);
    return {share * x, share * y, -half_height_};
}

void Movable::place_at(const Place& place) {
    place_ = place;
    const double half_x = kind_.figure.half_x, half_y = kind_.figure.half_y;
    for (int i = 0; i < kFeet; ++i) {
        const Vector local = foot(i);
        feet_[i] = place.turned(local[0], local[1]);
        corners_[i] = place.turned(i & 1 ? half_x : -half_x, i & 2 ? half_y : -half_y);
    }
    if (stands_ || !expects_) return;
    expect_slips(motion());
    expects_ = false;
}

Twist Movable::motion() const {
    const dReal* v = dBodyGetLinearVel(body_);
    return {v[0], v[1], dBodyGetAngularVel(body_)[2]};
}

Vector Movable::slip(int number, const Twist& motion) const {
    const Vector& to = feet_[number];
    return {motion.x - motion.spin * to[1], motion.y + motion.spin * to[0], 0};
}

void Movable::expect_slips(const Twist& motion) {
    for (int i = 0; i < kFeet; ++i) {
        const double limit = is_level_ ? foot_limit_ : kind_.config.friction * loads_[i];
        rubs_[i].expect(limit, place_.forward(), slip(i, motion));
    }
}

void Movable::add_to(CompliantStep& step) {
    for (int i = 0; i < kFeet; ++i) step.add_rub(rubs_[i], feet_[i], {});
}

void Movable::add_to(Contacts& contacts) {
    dBodySetForce(body_, 0, 0, 0);
    dBodySetTorque(body_, 0, 0, 0);
    for (int i = 0; i < kFeet; ++i) {
        if (is_level_) {
            rubs_[i].add(contacts, body_, place_.x + feet_[i][0], place_.y + feet_[i][1], {});
        } else {
            const Vector at = to_world(body_, foot(i));
            rubs_[i].add_pressed(contacts, body_, at, at[2]);
        }
    }
}

bool Movable::fits() {
    bool all = true;
    for (int i = 0; i < kFeet; ++i) {
        const double limit = is_level_ ? foot_limit_ : rubs_[i].limit();  // that of the step before
        if (limit > 0) all &= rubs_[i].fits(slip(i, motion()), limit);
    }
    return all;
}

void Movable::finish(bool by_ode) {
    if (stands_) {
        dBodySetLinearVel(body_, 0, 0, 0);
        dBodySetAngularVel(body_, 0, 0, 0);
    } else if (!is_level_) {
        for (int i = 0; i < kFeet; ++i) loads_[i] = std::max(0.0, rubs_[i].load());
    } else if (by_ode) {
        for (int i = 0; i < kFeet; ++i) {
            const Vector force = rubs_[i].force(slip(i, motion()));
            rubs_[i].remember(force[0], force[1]);
        }
    }
}

bool Movable::withstands(Load load) {
    take_by_walls(load);
    const Hold hold = hold_of(feet_, foot_limit_, load, kHoldPrecision);
    if (hold.factor >= 1) return true;
    stands_ = expects_ = false;
    const double speed = norm(hold.motion.x, hold.motion.y) + std::abs(hold.motion.spin) * kind_.figure.reach;
    const double scale = kFirstSpeed / speed;
    expect_slips({scale * hold.motion.x, scale * hold.motion.y, scale * hold.motion.spin});
    return false;
}

// Takes away what presses on straight walls, and what torque they can hold against then.
void Movable::take_by_walls(Load& load) const {
    for (const Wall& wall : scene_.arena.walls()) {
        const Vector out = {-wall.normal_x, -wall.normal_y, 0};
        const double press = load.x * out[0] + load.y * out[1];
        const double to_wall = wall.offset - (place_.x * out[0] + place_.y * out[1]);
        double least = HUGE_VAL, most = -HUGE_VAL;  // where along the wall corners touch it [m]
        const auto touch = [&](const Vector& to) {
            if (to[0] * out[0] + to[1] * out[1] < to_wall - kTouchingGap) return;
            least = std::min(least, to[1] * out[0] - to[0] * out[1]);
            most = std::max(most, to[1] * out[0] - to[0] * out[1]);
        };
        if (kind_.figure.is_round)
            touch({kind_.figure.half_x * out[0], kind_.figure.half_x * out[1], 0});
        else
            for (const Vector& to : corners_) touch(to);
        if (press <= 0 || least > most) continue;
        // A wall's force -press * out at `at` along the wall has the torque press * at.
        const double at = std::clamp(-load.torque / press, least, most);
        load.x -= press * out[0];
        load.y -= press * out[1];
        load.torque += press * at;
    }
}

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "fixture.hpp"
#include "rng.hpp"
#include "world/limit_curve.hpp"

using namespace swarmevo;

namespace {

constexpr double kHalfX = 0.1375, kHalfY = 0.09;  // of the paper's box [m]
constexpr double kLimit = 0.36;                   // of friction at a foot [N]
constexpr double kPrecision = 1e-4, kNear = 1e-3;

// Uniform numbers in (-1, 1).
struct Random {
    std::uint32_t count = 0;
    double operator()() { return symmetric(draw({2, 0, 0, 0}, Purpose::start, 0, count++)[0]); }
};

Vector turned_by(double heading, double x, double y) {
    return {std::cos(heading) * x - std::sin(heading) * y, std::sin(heading) * x + std::cos(heading) * y, 0};
}

Feet corners(double heading) {
    return {turned_by(heading, -kHalfX, -kHalfY), turned_by(heading, kHalfX, -kHalfY),
            turned_by(heading, -kHalfX, kHalfY), turned_by(heading, kHalfX, kHalfY)};
}

double reach() {
    return std::hypot(kHalfX, kHalfY);
}

// What the feet take of a motion over what the load gains from it; infinity where it gains nothing.
double cost(const Feet& feet, double limit, const Load& load, const Twist& t) {
    const double gain = load.x * t.x + load.y * t.y + load.torque * t.spin;
    if (gain <= 0) return INFINITY;
    double taken = 0;
    for (const Vector& foot : feet) taken += limit * std::hypot(t.x - t.spin * foot[1], t.y + t.spin * foot[0]);
    return taken / gain;
}

// The smallest of all costs: tried all over the sphere of (x, y, spin * reach), then ever finer about the best.
double least_cost(const Feet& feet, double limit, const Load& load) {
    constexpr int kAround = 120, kUp = 60, kNeighbours = 4, kRounds = 60;
    constexpr double kFiner = 0.75;
    double best = INFINITY, best_azimuth = 0, best_height = 0;
    const auto attempt = [&](double azimuth, double elevation) {
        const double level = std::cos(elevation);
        const Twist t = {level * std::cos(azimuth), level * std::sin(azimuth), std::sin(elevation) / reach()};
        const double found = cost(feet, limit, load, t);
        if (found >= best) return;
        best = found;
        best_azimuth = azimuth;
        best_height = elevation;
    };
    for (int i = 0; i < kAround; ++i)
        for (int j = 0; j <= kUp; ++j) attempt(2 * kPi * i / kAround, kPi * (1.0 * j / kUp - 0.5));
    double width = 2 * kPi / kAround;
    for (int round = 0; round < kRounds; ++round, width *= kFiner) {
        const double azimuth = best_azimuth, height = best_height;
        for (int i = -kNeighbours; i <= kNeighbours; ++i)
            for (int j = -kNeighbours; j <= kNeighbours; ++j)
                attempt(azimuth + width * i / kNeighbours / std::max(std::cos(height), 0.01),
                        height + width * j / kNeighbours);
    }
    return best;
}

Load times(double factor, const Load& load) {
    return {factor * load.x, factor * load.y, factor * load.torque};
}

// Do the feet give way to a load at `factor` times it, and neither before nor after?
void check_gives_way_at(double factor, const Feet& feet, double limit, const Load& load) {
    CAPTURE(factor);
    const Load less = times((1 - kNear) * factor, load), more = times((1 + kNear) * factor, load);
    CHECK(hold_of(feet, limit, less, kPrecision).factor >= 1);
    const Hold hold = hold_of(feet, limit, more, kPrecision);
    CHECK(hold.factor < 1);
    // The motion is the proof: the load gains more from it than the feet take.
    CHECK(cost(feet, limit, more, hold.motion) < 1);
}

// Of robots side by side that press the long face to the north, the centre of the outermost at `outer` [m].
Load pressed(int robots, double force, double outer) {
    const Scene scene = Fixture().scene();
    Load load{};
    for (int i = 0; i < robots; ++i) {
        load.y += force;
        load.torque += force * (outer - 2 * scene.robot.radius * i);
    }
    return load;
}

}  // namespace

TEST_CASE("feet hold until some motion gains more from the load than they take, by trying all motions") {
    Random random;
    for (int i = 0; i < 200; ++i) {
        const Feet feet = corners(kPi * random());
        const double share = random();  // of torque, between none and nothing else
        const Load load = {random(), random(), 3 * share * share * share * reach()};
        check_gives_way_at(least_cost(feet, kLimit, load), feet, kLimit, load);
    }
}

TEST_CASE("feet hold a force at their middle up to the sum of their limits, at every heading") {
    for (int i = 0; i < 60; ++i)
        for (const double direction : {0.0, 0.4, kPi / 2, 2.0}) {
            const Load load = {std::cos(direction), std::sin(direction), 0};
            check_gives_way_at(4 * kLimit, corners(2 * kPi * i / 60), kLimit, load);
        }
}

TEST_CASE("feet hold a torque up to the sum of their limits at their reach") {
    for (int i = 0; i < 60; ++i)
        for (const double sign : {-1.0, 1.0})
            check_gives_way_at(4 * kLimit * reach(), corners(2 * kPi * i / 60), kLimit, {0, 0, sign});
}

TEST_CASE("feet that carry nothing hold nothing, and what is not loaded is held") {
    CHECK(std::isinf(hold_of(corners(0.3), kLimit, {0, 0, 0}, kPrecision).factor));
    CHECK(hold_of(corners(0.3), 1e-9, {1e-6, 0, 0}, kPrecision).factor < 1);
}

TEST_CASE("two robots at an end of the long face need a friction of 0.586 to be held") {
    const Scene scene = Fixture().scene();
    const double weight = scene.movables[0].config.mass * scene.physics.gravity, force = traction_limit(scene);
    CHECK(force == doctest::Approx(0.5232));
    const Load load = pressed(2, force, kHalfX);
    // Limits grow with friction, so it is the inverse of what a friction of 1 would hold.
    const double needed = 1 / least_cost(corners(0), weight / 4, load);
    CHECK(needed == doctest::Approx(0.586).epsilon(2e-3));
    check_gives_way_at(1, corners(0), needed * weight / 4, load);

    CHECK(hold_of(corners(0), 0.62 * weight / 4, load, kPrecision).factor >= 1);
    CHECK(hold_of(corners(0), 0.575 * weight / 4, load, kPrecision).factor < 1);
    // Three give it more than it has wherever they stand.
    CHECK(hold_of(corners(0), 0.62 * weight / 4, pressed(3, force, 2 * scene.robot.radius), kPrecision).factor < 1);
}

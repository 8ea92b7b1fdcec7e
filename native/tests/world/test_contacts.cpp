// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "world/contacts.hpp"
#include "world/cubes.hpp"

using namespace swarmevo;
using namespace swarmevo::cubes;

TEST_CASE("a gap may close within the step and no more") {
    for (const double gap : {1e-5, 1e-3, 0.02}) {
        Cubes cubes;
        dBodySetLinearVel(cubes.bodies[0], 0, 0, -10);
        cubes.contacts.begin(kStep, false);
        cubes.touch_floor(cubes.bodies[0], gap, kSmooth);
        cubes.world.step(kStep);
        // It gives by CFM times the force that stops the body.
        const double force = kMass * (10 - gap / kStep) / kStep, softness = cubes.settings.contact_cfm * force;
        const double closed = kSide / 2 - dBodyGetPosition(cubes.bodies[0])[2];
        CHECK(closed == doctest::Approx(gap + softness * kStep).epsilon(0.01));
        CHECK(cubes.contacts.deepest_overlap() == 0);
    }
}

TEST_CASE("a gap that stays open holds nothing back, nor does a contact pull") {
    Cubes cubes;
    for (const double speed : {-0.09, 1.0}) {
        dBodySetLinearVel(cubes.bodies[0], 0, 0, speed);
        cubes.contacts.begin(kStep, false);
        cubes.touch_floor(cubes.bodies[0], 0.001, kSmooth);
        cubes.world.step(kStep);
        CHECK(dBodyGetLinearVel(cubes.bodies[0])[2] == doctest::Approx(speed));
    }
}

TEST_CASE("an overlap is pushed apart by ERP in each step, and noted") {
    Cubes cubes;
    double depth = 0.005;
    for (int i = 0; i < 20; ++i) {
        dBodySetLinearVel(cubes.bodies[0], 0, 0, 0);
        const double height = dBodyGetPosition(cubes.bodies[0])[2];
        cubes.contacts.begin(kStep, false);
        cubes.touch_floor(cubes.bodies[0], -depth, kSmooth);
        cubes.world.step(kStep);
        const double lifted = dBodyGetPosition(cubes.bodies[0])[2] - height;
        CHECK(lifted == doctest::Approx(kErp * depth).epsilon(1e-3));
        depth -= lifted;
    }
    CHECK(cubes.contacts.deepest_overlap() == 0.005);
}

TEST_CASE("soft contacts sink in twice as deep, each another bit deeper") {
    const auto depth = [](bool soft, int earlier) {
        Cubes cubes(1 + earlier, kGravity);
        for (int i = 0; i < 500; ++i) {
            cubes.contacts.begin(kStep, soft);
            for (const dBodyID body : cubes.bodies) cubes.stand(body, kSmooth);
            cubes.world.step(kStep);
        }
        return kSide / 2 - dBodyGetPosition(cubes.bodies[static_cast<std::size_t>(earlier)])[2];
    };
    const double hard = physics().contact_cfm * kMass * kGravity * kStep / kErp;  // where ERP and CFM balance
    CHECK(depth(false, 0) == doctest::Approx(hard).epsilon(1e-4));
    CHECK(depth(true, 0) == doctest::Approx(2 * hard).epsilon(1e-4));
    CHECK(depth(true, 3) == doctest::Approx((2 + 3 / 13.0) * hard).epsilon(1e-4));
}

TEST_CASE("friction holds up to its limit along and across, and takes no more beyond it") {
    const double along = 0.5, across = 0.2, weight = kMass * kGravity;
    const auto speed_after_pull = [&](double x, double y) {
        Cubes cubes(1, kGravity);
        for (int i = 0; i < 100; ++i) {
            cubes.contacts.begin(kStep, false);
            cubes.stand(cubes.bodies[0], {kEast, along, across, 0});
            dBodyAddForce(cubes.bodies[0], x, y, 0);
            cubes.world.step(kStep);
        }
        const dReal* v = dBodyGetLinearVel(cubes.bodies[0]);
        CHECK(std::abs(v[2]) < 1e-4);
        return std::hypot(v[0], v[1]);
    };
    // What CFM lets creep is below 1e-5 m/s for a newton.
    CHECK(speed_after_pull(0.99 * along * weight, 0) < 1e-5);
    CHECK(speed_after_pull(0, 0.99 * across * weight) < 1e-5);
    // v = (F / m - mu g) t, at t = 1 s.
    CHECK(speed_after_pull(1.5 * along * weight, 0) == doctest::Approx(0.5 * along * kGravity).epsilon(0.01));
    CHECK(speed_after_pull(0, 1.5 * across * weight) == doctest::Approx(0.5 * across * kGravity).epsilon(0.01));
    CHECK(speed_after_pull(0, -1.5 * across * weight) == doctest::Approx(0.5 * across * kGravity).epsilon(0.01));
}

TEST_CASE("friction brakes a sliding body by mu g and leaves it at rest") {
    Cubes cubes(1, kGravity);
    const double mu = 0.4, speed = 1;
    dBodySetLinearVel(cubes.bodies[0], speed, 0, 0);
    for (int i = 1; i <= 100; ++i) {
        cubes.contacts.begin(kStep, false);
        cubes.stand(cubes.bodies[0], {kEast, mu, mu, 0});
        cubes.world.step(kStep);
        const double expected = std::max(0.0, speed - mu * kGravity * i * kStep);
        CHECK(dBodyGetLinearVel(cubes.bodies[0])[0] == doctest::Approx(expected).scale(1).epsilon(0.002));
    }
}

TEST_CASE("a wheel's rim takes its body along, by friction alone and no faster than it turns") {
    Cubes cubes(1, kGravity);
    const double mu = 0.5, rim = 0.3;
    for (int i = 1; i <= 20; ++i) {
        cubes.contacts.begin(kStep, false);
        cubes.stand(cubes.bodies[0], {{0, 1, 0}, mu, mu, rim});
        cubes.world.step(kStep);
        const dReal* v = dBodyGetLinearVel(cubes.bodies[0]);
        const double expected = std::min(rim, mu * kGravity * i * kStep);
        CHECK(v[1] == doctest::Approx(expected).epsilon(0.01));
        CHECK(v[0] == doctest::Approx(0));
    }
}

TEST_CASE("two bodies in contact stop each other and keep their momentum") {
    Cubes cubes(2);
    dBodySetLinearVel(cubes.bodies[0], 3, 0, 0);
    cubes.contacts.begin(kStep, false);
    cubes.contacts.add(cubes.bodies[0], cubes.bodies[1], {0.5, 0, kSide / 2}, {-1, 0, 0}, 0.005, kSmooth);
    cubes.world.step(kStep);
    const double first = dBodyGetLinearVel(cubes.bodies[0])[0], second = dBodyGetLinearVel(cubes.bodies[1])[0];
    CHECK(first + second == doctest::Approx(3));
    CHECK(first - second == doctest::Approx(0.005 / kStep).epsilon(0.01));
}

TEST_CASE("contacts that were forgotten act no more") {
    Cubes cubes;
    cubes.contacts.begin(kStep, false);
    cubes.touch_floor(cubes.bodies[0], 0, kSmooth);
    cubes.contacts.begin(kStep, false);
    dBodySetLinearVel(cubes.bodies[0], 0, 0, -1);
    cubes.world.step(kStep);
    CHECK(dBodyGetLinearVel(cubes.bodies[0])[2] == -1);
}

TEST_CASE("friction that slips is a damper, by the force of the end of the step, up to its limit") {
    constexpr double kSpeed = 0.1, kAim = 0.04;
    for (const double slip : {0.0, 0.1, 2.0})
        for (const double limit : {double(dInfinity), 0.02}) {
            CAPTURE(slip);
            CAPTURE(limit);
            Cubes cubes(0);
            const dBodyID body = create_level_body(cubes.world.id(), {0, 0, 0}, 0.3, kMass, 1e-4);
            dBodySetLinearVel(body, kSpeed, kSpeed, 0);
            cubes.contacts.begin(kStep, false);
            Friction friction{kEast, limit, 0, kAim};
            friction.load = 1;
            friction.slip_along = slip;
            cubes.contacts.add_level(body, 0, 0, friction);
            cubes.world.step(kStep);
            // m (v' - v) / h = (aim - v') / slip
            const double lag = slip * kMass / kStep, damped = (kAim + lag * kSpeed) / (1 + lag);
            const BodyState state = state_of(body);
            CHECK(state.velocity[0] ==
                  doctest::Approx(std::max(damped, kSpeed - limit * kStep / kMass)).scale(0).epsilon(1e-3));
            CHECK(state.velocity[1] == doctest::Approx(kSpeed));
        }
}

// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <thread>
#include <vector>

#include "error.hpp"
#include "fixture.hpp"
#include "world/contacts.hpp"
#include "world/world.hpp"

#if defined(__SANITIZE_ADDRESS__)
#include <sanitizer/lsan_interface.h>
#endif

using namespace swarmevo;

namespace {

constexpr double kStep = 0.01, kMass = 0.1, kSide = 0.1, kGravity = 9.81, kErp = 0.2;
constexpr Vector kUp = {0, 0, 1}, kEast = {1, 0, 0};
constexpr Friction kSmooth = {kEast, 0, 0, 0};

swe_physics_config physics() {
    return Fixture().config.physics;
}

// A world with our settings of contacts and `n` cubes in a row, a metre apart, that touch each other nowhere.
struct Cubes {
    const swe_physics_config settings = physics();
    OdeWorld world;
    Contacts contacts{world, settings};
    std::vector<dBodyID> bodies;

    explicit Cubes(int n = 1, double gravity = 0) {
        dWorldSetGravity(world.id(), 0, 0, -gravity);
        dWorldSetERP(world.id(), kErp);
        dWorldSetCFM(world.id(), settings.contact_cfm);
        dMass mass;
        dMassSetBoxTotal(&mass, kMass, kSide, kSide, kSide);
        for (int i = 0; i < n; ++i) bodies.push_back(create_body(world.id(), {1.0 * i, 0, kSide / 2}, 0, 0, mass));
    }

    // A contact of a body with the floor at the body's centre, so that friction turns nothing.
    void touch_floor(dBodyID body, double gap, const Friction& friction) {
        const dReal* p = dBodyGetPosition(body);
        contacts.add(body, nullptr, {p[0], p[1], p[2]}, kUp, gap, friction);
    }
    void stand(dBodyID body, const Friction& friction) {
        touch_floor(body, dBodyGetPosition(body)[2] - kSide / 2, friction);
    }

    // Slides, rubs and falls for a while. All bits of where that leads.
    std::vector<double> tumble(int steps) {
        std::vector<double> bits;
        for (int i = 0; i < steps; ++i) {
            contacts.begin(kStep, false);
            for (const dBodyID body : bodies) {
                stand(body, {kEast, 0.5, 0.3, 0.1});
                dBodyAddTorque(body, 1e-4, 2e-4, 1e-4);
            }
            world.step(kStep);
        }
        for (const dBodyID body : bodies) {
            const BodyState state = state_of(body);
            bits.insert(bits.end(), state.position, state.position + 3);
            bits.insert(bits.end(), state.quaternion, state.quaternion + 4);
            bits.insert(bits.end(), state.velocity, state.velocity + 3);
            bits.insert(bits.end(), state.spin, state.spin + 3);
        }
        return bits;
    }
};

std::vector<double> tumbled() {
    return Cubes(3, kGravity).tumble(200);
}

// Worlds that ODE broke are leaked on purpose.
class LeaksOnPurpose {
#if defined(__SANITIZE_ADDRESS__)
    __lsan::ScopedDisabler disabler_;
#else
  public:
    LeaksOnPurpose() {}  // so that no compiler calls it unused
#endif
};

}  // namespace

// ---- bodies ----

TEST_CASE("a body that falls falls by the closed formula of the solver's steps") {
    Cubes cubes(1, kGravity);
    for (int i = 0; i < 10; ++i) CHECK(cubes.world.step(kStep) == 0);
    const BodyState state = state_of(cubes.bodies[0]);
    CHECK(state.velocity[2] == doctest::Approx(-kGravity * 10 * kStep));
    CHECK(state.position[2] == doctest::Approx(kSide / 2 - kGravity * kStep * kStep * 55));  // 1 + 2 + ... + 10
}

TEST_CASE("a state that is set is the state that is read, and leads to the same bits") {
    Cubes cubes(1, kGravity);
    const dBodyID body = cubes.bodies[0];
    dBodySetLinearVel(body, 0.1, -0.2, 0.3);
    dBodySetAngularVel(body, 3, 2, -1);
    for (int i = 0; i < 3; ++i) cubes.world.step(kStep);
    const BodyState before = state_of(body);
    const auto same = [&](const BodyState& now) {
        for (int i = 0; i < 3; ++i) {
            CHECK(now.position[i] == before.position[i]);
            CHECK(now.velocity[i] == before.velocity[i]);
            CHECK(now.spin[i] == before.spin[i]);
        }
    };
    cubes.world.step(kStep);
    const BodyState once = state_of(body);

    set_state(body, before);
    same(state_of(body));
    for (int i = 0; i < 4; ++i) CHECK(state_of(body).quaternion[i] == doctest::Approx(before.quaternion[i]));
    cubes.world.step(kStep);
    const BodyState again = state_of(body);
    for (int i = 0; i < 3; ++i) CHECK(again.position[i] == once.position[i]);
    for (int i = 0; i < 4; ++i) CHECK(again.quaternion[i] == once.quaternion[i]);
}

TEST_CASE("a body is made at rest, nose down by its pitch and turned by its heading") {
    const OdeWorld world;
    dMass mass;
    dMassSetBoxTotal(&mass, kMass, kSide, kSide, kSide);
    const double heading = 0.7, pitch = 0.2;
    const dBodyID body = create_body(world.id(), {1, 2, 3}, heading, pitch, mass);
    CHECK(dBodyGetLinearVel(body)[0] == 0);
    CHECK(dBodyGetAngularVel(body)[2] == 0);

    const Vector forward = axis(body, 0), leftward = axis(body, 1);
    CHECK(forward[0] == doctest::Approx(std::cos(pitch) * std::cos(heading)));
    CHECK(forward[1] == doctest::Approx(std::cos(pitch) * std::sin(heading)));
    CHECK(forward[2] == doctest::Approx(-std::sin(pitch)));
    CHECK(leftward[0] == doctest::Approx(-std::sin(heading)));
    CHECK(leftward[2] == doctest::Approx(0));
    CHECK(pose_of(body).x == 1);
    CHECK(pose_of(body).y == 2);
    CHECK(pose_of(body).heading == doctest::Approx(heading));
}

TEST_CASE("a point of a body is found in the world") {
    const OdeWorld world;
    dMass mass;
    dMassSetBoxTotal(&mass, kMass, kSide, kSide, kSide);
    const dBodyID turned = create_body(world.id(), {1, 2, 3}, kPi / 2, 0, mass);
    const Vector point = to_world(turned, {0.1, 0.2, 0.3});
    CHECK(point[0] == doctest::Approx(0.8));
    CHECK(point[1] == doctest::Approx(2.1));
    CHECK(point[2] == doctest::Approx(3.3));
    const dBodyID nodding = create_body(world.id(), {0, 0, 0}, 0, kPi / 2, mass);
    CHECK(to_world(nodding, {0.1, 0, 0})[2] == doctest::Approx(-0.1));
}

// ---- contacts ----

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

// ---- worlds ----

TEST_CASE("worlds stepped side by side in threads give the bits of one alone") {
    const std::vector<double> alone = tumbled();
    std::vector<double> results[2];
    std::vector<std::thread> threads;
    for (auto& result : results)
        threads.emplace_back([&result] {
            for (int i = 0; i < 5; ++i) result = tumbled();
        });
    for (std::thread& thread : threads) thread.join();
    CHECK(results[0] == alone);
    CHECK(results[1] == alone);
}

TEST_CASE("an assertion of ODE in a populated world breaks that world and no other") {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    const std::vector<double> alone = tumbled();
    Cubes other(3, kGravity);
    other.tumble(100);
    {
        const LeaksOnPurpose leaks;
        Cubes refused(3, kGravity);  // before anything was done
        refused.tumble(10);
        CHECK_THROWS_WITH_AS(refused.world.step(-kStep), doctest::Contains("stepsize must be > 0"), Error);
        CHECK(refused.world.is_broken());

        Cubes broken(3, kGravity);  // in the middle of the solution, with contacts and memory in use
        broken.tumble(10);
        broken.contacts.begin(kStep, false);
        for (const dBodyID body : broken.bodies) broken.stand(body, {kEast, 0.5, 0.3, 0.1});
        dBodySetAngularVel(broken.bodies[2], 0, 0, nan);
        CHECK_THROWS_WITH_AS(broken.world.step(kStep), doctest::Contains("dxNormalize4"), Error);
        CHECK(broken.world.is_broken());
    }
    CHECK(!other.world.is_broken());
    CHECK(other.tumble(100) == alone);  // goes on
    CHECK(tumbled() == alone);          // and so do new ones
}

TEST_CASE("robots, box and contacts of a world that was broken go without harm") {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    Fixture fixture(Fixture::aligned(3));
    fixture.box_at(0, 0.2).without_noise().config.physics.time_step = 0.005;
    for (const int drive : {SWE_DRIVE_DRIVEN_CONTACTS, SWE_DRIVE_ARTICULATED}) {
        const char* reason = drive == SWE_DRIVE_ARTICULATED ? "ODE failed" : "a force is not finite";
        fixture.config.physics.drive = drive;
        const Scene scene = fixture.scene();
        World other(scene, scene.start_poses);
        {
            const LeaksOnPurpose leaks;
            World broken(scene, scene.start_poses);
            for (unsigned robot = 0; robot < 3; ++robot) broken.set_rim_speeds(robot, 0.1, 0.1);
            for (int i = 0; i < 200; ++i) broken.step();  // until they push
            broken.set_rim_speeds(1, nan, nan);
            CHECK_THROWS_WITH_AS(broken.step(), doctest::Contains(reason), Error);
        }
        for (int i = 0; i < 200; ++i) other.step();
        CHECK_NOTHROW(other.fold_state(0));
    }
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

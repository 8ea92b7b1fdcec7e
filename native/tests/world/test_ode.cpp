// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <thread>
#include <vector>

#include "error.hpp"
#include "fixture.hpp"
#include "world/cubes.hpp"
#include "world/ode.hpp"
#include "world/world.hpp"

#if defined(__has_feature)  // clang's
#define FINDS_LEAKS __has_feature(address_sanitizer)
#elif defined(__SANITIZE_ADDRESS__)
#define FINDS_LEAKS 1
#else
#define FINDS_LEAKS 0
#endif
#if FINDS_LEAKS
#include <sanitizer/lsan_interface.h>
#endif

using namespace swarmevo;
using namespace swarmevo::cubes;

namespace {

std::vector<double> tumbled() {
    return Cubes(3, kGravity).tumble(200);
}

// Worlds that ODE broke are leaked on purpose.
class LeaksOnPurpose {
#if FINDS_LEAKS
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
    fixture.box_at(0, 0.2).without_noise().config.physics.time_step = 0.004;
    for (const int drive : {SWE_DRIVE_DRIVEN_CONTACTS, SWE_DRIVE_ARTICULATED}) {
        const char* reason = drive == SWE_DRIVE_ARTICULATED ? "ODE failed" : "a force is not finite";
        fixture.config.physics.drive = drive;
        const Scene scene = fixture.scene();
        World other(scene, starts_of(scene));
        {
            const LeaksOnPurpose leaks;
            World broken(scene, starts_of(scene));
            for (unsigned robot = 0; robot < 3; ++robot) broken.set_rim_speeds(robot, 0.1, 0.1);
            for (int i = 0; i < 250; ++i) broken.step();  // until they push
            broken.set_rim_speeds(1, nan, nan);
            CHECK_THROWS_WITH_AS(broken.step(), doctest::Contains(reason), Error);
        }
        for (int i = 0; i < 200; ++i) other.step();
        CHECK_NOTHROW(other.fold_state(0));
    }
}

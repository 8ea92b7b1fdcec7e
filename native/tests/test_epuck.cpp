// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include "epuck.hpp"
#include "fixture.hpp"

using namespace swarmevo;

TEST_CASE("the robot's geometry and drive follow from its config") {
    const Fixture fixture;
    const Scene scene = fixture.scene();
    CHECK(wheel_centre(scene.robot, left)[1] == doctest::Approx(0.0265));
    CHECK(wheel_centre(scene.robot, right)[1] == doctest::Approx(-0.0265));
    CHECK(caster_tip(scene.robot, -1)[0] == doctest::Approx(-0.03));
    CHECK(caster_tip(scene.robot, 1)[2] == doctest::Approx(0.0005 - 0.015));
    CHECK(rim_speed(scene.robot, 1, 0) == doctest::Approx(0.12874));  // physics: 0.129 m/s
    CHECK(rim_speed(scene.robot, -0.5, 0.05) == doctest::Approx(-0.5 * 1.05 * 0.12874));
    // Half as much again would be its weight: a third of it lies on a caster.
    CHECK(traction_limit(scene) == doctest::Approx(0.08 * 9.81 / 1.5));
    CHECK(robot_inertia(scene.robot).vertical == doctest::Approx(0.08 * 0.035 * 0.035 / 2));
}

// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "fixture.hpp"
#include "world/world.hpp"

using namespace swarmevo;

namespace {

// Where a robot is after five seconds of an arc.
Pose arc(int drive, double time_step, double left_speed, double right_speed) {
    Fixture fixture({0, -0.25, 0});
    fixture.without_noise().config.physics.time_step = time_step;
    fixture.config.physics.drive = drive;
    const Scene scene = fixture.scene();
    World world(scene, starts_of(scene));
    world.set_rim_speeds(0, left_speed, right_speed);
    for (long i = 0; i < std::lround(5 / time_step); ++i) world.step();
    return world.robot_pose(0);
}

double apart(const Pose& a, const Pose& b) {
    return std::hypot(a.x - b.x, a.y - b.y);
}

}  // namespace

TEST_CASE("driven contacts follow the articulated model and the circle of its wheels") {
    const double left_speed = 0.05, right_speed = 0.1, axle = 0.053;
    const double turning = (right_speed - left_speed) / axle, radius = (left_speed + right_speed) / 2 / turning;
    const Pose circle = {radius * std::sin(5 * turning), -0.25 + radius * (1 - std::cos(5 * turning)), 5 * turning};
    const Pose reference = arc(SWE_DRIVE_ARTICULATED, 0.0005, left_speed, right_speed);
    CHECK(apart(reference, circle) < 0.001);
    for (const double time_step : {0.001, 0.02, 0.05}) {
        const Pose pose = arc(SWE_DRIVE_DRIVEN_CONTACTS, time_step, left_speed, right_speed);
        CHECK(apart(pose, reference) < 0.001);
        CHECK(std::abs(std::remainder(pose.heading - reference.heading, 2 * kPi)) < 0.01);
    }
}

// Casters do not rub: the floor's pull on the wheels is at most mu times the weight. Every half second the robot is
// told to drive the same arc the other way.
TEST_CASE("friction of the wheels never changes a robot's velocity faster than mu g") {
    for (const std::int32_t drive : {SWE_DRIVE_DRIVEN_CONTACTS, SWE_DRIVE_ARTICULATED})
        for (const double friction : {0.1, 0.2, 1.0})
            for (const double inner_speed : {-0.03, 0.03, 0.06, 0.1}) {
                Fixture fixture({0, -0.25, 0});
                swe_physics_config& physics = fixture.without_noise().config.physics;
                physics.drive = drive;
                physics.time_step = 0.004;
                physics.wheel_friction = friction;
                const Scene scene = fixture.scene();
                World world(scene, starts_of(scene));
                Pose before = world.robot_pose(0);
                double vx = 0, vy = 0, largest = 0;
                for (int i = 0; i < 750; ++i) {
                    const double sign = i / 125 % 2 == 0 ? 1 : -1;
                    world.set_rim_speeds(0, sign * 0.12, sign * inner_speed);
                    world.step();
                    const Pose now = world.robot_pose(0);
                    const double x = (now.x - before.x) / physics.time_step, y = (now.y - before.y) / physics.time_step;
                    largest = std::max(largest, std::hypot(x - vx, y - vy) / physics.time_step);
                    before = now, vx = x, vy = y;
                }
                INFO(drive, ", ", friction, ", ", inner_speed);
                CHECK(largest / (friction * physics.gravity) < 1.15);  // it pitches, and its chassis with it
                CHECK(largest / (friction * physics.gravity) > 0.3);
            }
}

TEST_CASE("the articulated robot has the same weight and traction: two do not move the box, three do") {
    for (const int n : {2, 3}) {
        Fixture fixture(Fixture::aligned(n));
        fixture.without_noise().box_at(0, 0.2).config.physics.time_step = 0.004;
        fixture.config.physics.drive = SWE_DRIVE_ARTICULATED;
        const Scene scene = fixture.scene();
        World world(scene, starts_of(scene));
        for (int i = 0; i < n; ++i) world.set_rim_speeds(static_cast<unsigned>(i), 0.12, 0.12);
        for (int i = 0; i < 5000; ++i) world.step();
        if (n == 2)
            CHECK(world.movable_pose(0).y < 0.205);
        else
            CHECK(world.movable_pose(0).y == doctest::Approx(0.41).epsilon(0.001));
    }
}

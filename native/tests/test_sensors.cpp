// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "epuck.hpp"
#include "fixture.hpp"
#include "sensors.hpp"

using namespace swarmevo;

namespace {

constexpr EpisodeKey kKey = {1, 0, 0, 0};

// Reference: walks along the ray until it is inside something.
double march(const Scene& scene, const Snapshot& now, unsigned robot, double x, double y, double dx, double dy) {
    constexpr double stride = 2e-5;
    const double half = scene.arena.size / 2;
    const double c = std::cos(now.box.heading), s = std::sin(now.box.heading);
    for (double t = 0; t <= 0.07; t += stride) {
        const double px = x + t * dx, py = y + t * dy;
        if (std::max(std::abs(px), std::abs(py)) >= half) return t;
        for (unsigned i = 0; i < now.robots.size(); ++i)
            if (i != robot && std::hypot(px - now.robots[i].x, py - now.robots[i].y) <= scene.robot.radius) return t;
        if (scene.sensors.infrared_target == SWE_INFRARED_TARGET_ALL) {
            const double bx = px - now.box.x, by = py - now.box.y;
            if (std::abs(c * bx + s * by) <= scene.box.size[0] / 2 &&
                std::abs(c * by - s * bx) <= scene.box.size[1] / 2)
                return t;
        }
    }
    return std::numeric_limits<double>::infinity();
}

Snapshot random_snapshot(const Scene& scene, unsigned number) {
    Snapshot now;
    const double room = scene.arena.size / 2 - scene.robot.radius;
    for (unsigned i = 0; i < scene.robots; ++i) {
        const auto w = draw({99, 0, number, 0}, Purpose::start, i, 0);
        // Crowded into a corner region, so that rays meet something.
        now.robots.push_back({room - 0.3 * uniform(w[0]), room - 0.3 * uniform(w[1]), kPi * symmetric(w[2])});
    }
    const auto w = draw({98, 0, number, 0}, Purpose::start, 0, 0);
    now.box = {0.15 + 0.1 * symmetric(w[0]), 0.2 + 0.1 * symmetric(w[1]), kPi * symmetric(w[2])};
    return now;
}

// How one touch sensor answers to a robot at the box's south face with a heading and a gap.
double touch(const Scene& scene, unsigned sensor, double heading, double gap, double force = 0) {
    const double y = scene.box.pose[1] - scene.box.size[1] / 2 - scene.robot.radius - gap;
    const Snapshot now{{{0, y, heading}}, {scene.box.pose[0], scene.box.pose[1], 0}};
    double readings[SWE_TOUCH_SENSORS];
    sense_touch(scene, now, 0, force, readings);
    return readings[sensor];
}

}  // namespace

TEST_CASE("infrared distances agree with marching along the rays") {
    for (const int target : {SWE_INFRARED_TARGET_WALLS_AND_ROBOTS, SWE_INFRARED_TARGET_ALL}) {
        Fixture fixture;
        fixture.config.sensors.infrared_target = target;
        const Scene scene = fixture.scene();
        int met = 0;
        for (unsigned number = 0; number < 40; ++number) {
            const Snapshot now = random_snapshot(scene, number);
            for (unsigned robot = 0; robot < scene.robots; ++robot)
                for (unsigned sensor = 0; sensor < SWE_INFRARED_SENSORS; ++sensor) {
                    const double bearing =
                        now.robots[robot].heading + scene.sensors.infrared_yaw_deg[sensor] * kRadiansPerDegree;
                    const double dx = std::cos(bearing), dy = std::sin(bearing);
                    const double reference = march(scene, now, robot, now.robots[robot].x + scene.robot.radius * dx,
                                                   now.robots[robot].y + scene.robot.radius * dy, dx, dy);
                    const double distance = infrared_distance(scene, now, robot, sensor);
                    if (std::isinf(reference) || std::isinf(distance)) {
                        // Either both see nothing or the ray only grazes: less than a stride inside, or at the very
                        // end.
                        if (!std::isinf(reference)) CHECK(reference > 0.0699);
                        if (!std::isinf(distance) && distance < 0.0699) CHECK(distance == doctest::Approx(reference));
                        continue;
                    }
                    ++met;
                    CHECK(std::abs(distance - reference) < 1e-4);
                }
        }
        CHECK(met > 500);
    }
}

TEST_CASE("rays in odd places") {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    CHECK(ray_to_disc(0, 0, 1, 0, 0.5, 0, 1) == 0);                                                    // starts inside
    CHECK(ray_to_disc(0, 0, 1, 0, -2, 0, 1) == infinity);                                              // behind
    CHECK(ray_to_disc(0, 1, 1, 0, 3, 0, 1) == doctest::Approx(3));                                     // tangent
    CHECK(ray_to_rectangle(0, 0, 1, 0, {0.2, 0, 0.3}, 1, 1) == 0);                                     // starts inside
    CHECK(ray_to_rectangle(-2, 1, 1, 0, {0, 0, 0}, 1, 1) == doctest::Approx(1));                       // along an edge
    CHECK(ray_to_rectangle(-2, 0, 1, 0, {0, 0, kPi / 4}, 1, 1) == doctest::Approx(2 - std::sqrt(2)));  // onto a corner
    CHECK(ray_to_rectangle(-2, 0, -1, 0, {0, 0, 0}, 1, 1) == infinity);                                // away
    CHECK(ray_to_walls(0, 0, 0, 1, 0.5) == doctest::Approx(0.5));
    CHECK(ray_to_walls(0.49, 0.49, std::sqrt(0.5), std::sqrt(0.5), 0.5) == doctest::Approx(0.01 * std::sqrt(2)));
    CHECK(ray_to_walls(0.51, 0, 1, 0, 0.5) == 0);  // pressed a little into the wall
}

TEST_CASE("the infrared curve has its points, is linear in between and ends") {
    const Fixture fixture;
    const auto& sensors = fixture.config.sensors;
    CHECK(infrared_response(sensors, 0) == 1);
    CHECK(infrared_response(sensors, 0.01) == doctest::Approx(2211.0 / 4095));
    CHECK(infrared_response(sensors, 0.015) == doctest::Approx((2211 + 676) / 2.0 / 4095));
    CHECK(infrared_response(sensors, 0.07) == doctest::Approx(34.0 / 4095));
    CHECK(infrared_response(sensors, 0.0701) == 0);
}

TEST_CASE("infrared noise has the config's spread, 5 % far and 0.5 % at contact, and is the key's alone") {
    const Fixture fixture;
    const Scene scene = fixture.scene();
    const auto spread_at = [&](double gap) {
        const Snapshot now{
            {{0.465 - gap, 0, -90 * kRadiansPerDegree + kPi}, {0, 0, 0}, {0, .1, 0}, {0, .2, 0}, {0, -.2, 0}},
            {0, 0.345, 0}};
        double readings[8], sum = 0, squares = 0;
        const double exact = infrared_response(scene.sensors, gap);
        constexpr unsigned n = 20000;
        for (unsigned step = 0; step < n; ++step) {
            sense_infrared(scene, now, kKey, step, 0, readings);
            sum += readings[2] / exact - 1;  // ps2 looks right, at the east wall
            squares += (readings[2] / exact - 1) * (readings[2] / exact - 1);
        }
        CHECK(sum / n == doctest::Approx(0).scale(1).epsilon(0.002));
        return std::sqrt(squares / n);
    };
    CHECK(spread_at(0.03) == doctest::Approx(0.05).epsilon(0.03));
    CHECK(spread_at(0.005) == doctest::Approx(0.05).epsilon(0.03));
    CHECK(spread_at(0.0025) == doctest::Approx(0.0275).epsilon(0.03));
}

TEST_CASE("touch sensors answer in their sectors only, to the box only") {
    const Fixture fixture;
    const Scene scene = fixture.scene();
    // Heading north the box is straight ahead, between the two inner sensors; turned left it is to the right.
    CHECK(touch(scene, 1, kPi / 2 - 0.05, 0.001) == 1);
    CHECK(touch(scene, 2, kPi / 2 - 0.05, 0.001) == 0);
    CHECK(touch(scene, 2, kPi / 2 + 0.05, 0.001) == 1);
    CHECK(touch(scene, 3, kPi / 2 + 45 * kRadiansPerDegree, 0.001) == 1);
    CHECK(touch(scene, 0, kPi / 2 - 45 * kRadiansPerDegree, 0.001) == 1);
    for (unsigned sensor = 0; sensor < 4; ++sensor) {
        CHECK(touch(scene, sensor, -kPi / 2, 0.001) == 0);        // its back to the box
        CHECK(touch(scene, sensor, kPi / 2 - 0.05, 0.003) == 0);  // out of range
    }
}

TEST_CASE("touch sensors can be graded or measure force") {
    Fixture fixture;
    fixture.config.sensors.touch_mode = SWE_TOUCH_MODE_GRADED;
    CHECK(touch(fixture.scene(), 1, kPi / 2 - 0.05, 0.0005) == doctest::Approx(0.75));
    fixture.config.sensors.touch_mode = SWE_TOUCH_MODE_FORCE;
    const Scene scene = fixture.scene();
    CHECK(touch(scene, 1, kPi / 2 - 0.05, 0, traction_limit(scene) / 2) == doctest::Approx(0.5));
    CHECK(touch(scene, 1, kPi / 2 - 0.05, 0, 100) == 1);
}

TEST_CASE("RF strength is 1 / r^2 within its limits, and silent beyond its range unless the whole arena hears it") {
    Fixture fixture;
    const auto strength_at = [&](double distance) {
        const Scene scene = fixture.scene();
        return sense_rf(scene, {{{0, 0.345 - distance, 0}}, {}}, kKey, 0, 0);
    };
    const double dz = 0.05 - 0.03;
    CHECK(strength_at(0.2) == doctest::Approx(1 / (0.04 + dz * dz)));
    CHECK(strength_at(0) == 50);
    CHECK(strength_at(0.31) == 1);
    fixture.config.emitter.reach = SWE_REACH_ARENA;
    CHECK(strength_at(0.5) == doctest::Approx(1 / (0.25 + dz * dz)));
    CHECK(in_emitter_range(fixture.scene(), {0, 0.05, 0}));
    CHECK_FALSE(in_emitter_range(fixture.scene(), {0, 0.04, 0}));
}

// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "fixture.hpp"
#include "sensors/infrared.hpp"

using namespace swarmevo;

namespace {

constexpr EpisodeKey kKey = {1, 0, 0, 0};

constexpr unsigned kRandomScenes = 10000;

// How far a point is from everything that a robot's rays can meet; 0 inside.
double free_distance(const Scene& scene, const Snapshot& now, unsigned robot, double x, double y) {
    double nearest = scene.arena.bounds()[1] - std::max(std::abs(x), std::abs(y));
    for (unsigned i = 0; i < now.robots.size(); ++i)
        if (i != robot)
            nearest = std::min(nearest, std::hypot(x - now.robots[i].x, y - now.robots[i].y) - scene.robot.radius);
    if (scene.sensors.infrared_target == SWE_INFRARED_TARGET_ALL) {
        const double c = std::cos(now.movables[0].heading), s = std::sin(now.movables[0].heading);
        const double bx = x - now.movables[0].x, by = y - now.movables[0].y;
        nearest = std::min(nearest,
                           std::hypot(std::max(0.0, std::abs(c * bx + s * by) - scene.movables[0].config.size[0] / 2),
                                      std::max(0.0, std::abs(c * by - s * bx) - scene.movables[0].config.size[1] / 2)));
    }
    return std::max(0.0, nearest);
}

// Reference: walks along the ray, each time as far as nothing can be, until it is at something.
double march(const Scene& scene, const Snapshot& now, unsigned robot, double x, double y, double dx, double dy) {
    constexpr double arrived = 1e-10, range = 0.07;
    for (double way = 0; way <= range;) {
        const double free = free_distance(scene, now, robot, x + way * dx, y + way * dy);
        if (free < arrived) return way;
        way += free;
    }
    return std::numeric_limits<double>::infinity();
}

Snapshot random_snapshot(const Scene& scene, unsigned number) {
    Snapshot now;
    const double room = scene.arena.bounds()[1] - scene.robot.radius;
    for (unsigned i = 0; i < scene.robots; ++i) {
        const auto w = draw({99, 0, number, 0}, Purpose::start, i, 0);
        // Crowded into a corner region, so that rays meet something.
        now.robots.push_back({room - 0.3 * uniform(w[0]), room - 0.3 * uniform(w[1]), kPi * symmetric(w[2])});
    }
    const auto w = draw({98, 0, number, 0}, Purpose::start, 0, 0);
    now.movables.push_back({0.15 + 0.1 * symmetric(w[0]), 0.2 + 0.1 * symmetric(w[1]), kPi * symmetric(w[2])});
    return now;
}

}  // namespace

TEST_CASE("infrared distances agree with marching along the rays") {
    for (const int target : {SWE_INFRARED_TARGET_WALLS_AND_ROBOTS, SWE_INFRARED_TARGET_ALL}) {
        Fixture fixture;
        fixture.config.sensors.infrared_target = target;
        const Scene scene = fixture.scene();
        unsigned met = 0, edges = 0;
        double worst = 0;
        for (unsigned number = 0; number < kRandomScenes; ++number) {
            const Snapshot now = random_snapshot(scene, number);
            const unsigned robot = number % scene.robots;
            const Pose& me = now.robots[robot];
            for (unsigned sensor = 0; sensor < scene.sensors.infrared_count; ++sensor) {
                const double bearing = me.heading + scene.sensors.infrared_yaw_deg[sensor] * kRadiansPerDegree;
                const double dx = std::cos(bearing), dy = std::sin(bearing);
                const double reference =
                    march(scene, now, robot, me.x + scene.robot.radius * dx, me.y + scene.robot.radius * dy, dx, dy);
                const double distance = infrared_distance(scene, now, robot, sensor);
                if (std::isinf(reference) != std::isinf(distance)) {
                    ++edges;  // a ray that grazes, or ends at a surface
                } else if (!std::isinf(distance)) {
                    ++met;
                    worst = std::max(worst, std::abs(distance - reference));
                }
            }
        }
        CHECK(met > kRandomScenes);
        CHECK(edges <= 1);
        CHECK(worst < 1e-6);  // where a ray grazes, 1e-10 m beside a surface are this far along it
    }
}

TEST_CASE("rays from odd places: in a corner, inside the box, on top of another robot") {
    Fixture fixture;
    fixture.config.sensors.infrared_target = SWE_INFRARED_TARGET_ALL;
    const Scene scene = fixture.scene();
    const double room = scene.arena.bounds()[1] - scene.robot.radius;
    // Touching two walls, heading along one: ps2 looks straight right.
    const Snapshot corner{{{room, -room, 0}}, {{0, 0.345, 0}}, {}};
    CHECK(infrared_distance(scene, corner, 0, 2) == doctest::Approx(0).scale(1).epsilon(1e-12));
    CHECK(std::isinf(infrared_distance(scene, corner, 0, 5)));  // ps5 looks left, into the open

    const Snapshot inside{{{0.01, 0.345, 0}}, {{0, 0.345, 0}}, {}};  // its centre in the box: physics never lets it
    for (unsigned sensor = 0; sensor < scene.sensors.infrared_count; ++sensor)
        CHECK(infrared_distance(scene, inside, 0, sensor) == 0);

    const Snapshot stacked{{{0, 0, 0}, {0.01, 0, 1}}, {{0, 0.345, 0}}, {}};
    for (const unsigned sensor : {0u, 1u, 6u, 7u}) CHECK(infrared_distance(scene, stacked, 0, sensor) == 0);
    CHECK(std::isinf(infrared_distance(scene, stacked, 0, 3)));  // looks back, from outside the other
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
            {{0, 0.345, 0}},
            {}};
        double readings[8], sum = 0, squares = 0;
        const double exact = infrared_response(scene.sensors, gap);
        constexpr unsigned n = 20000;
        for (unsigned step = 0; step < n; ++step) {
            sense_infrared({scene, now, kKey, step, 0}, readings);
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

// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "epuck.hpp"
#include "fixture.hpp"
#include "sensors.hpp"

using namespace swarmevo;

namespace {

constexpr EpisodeKey kKey = {1, 0, 0, 0};

constexpr unsigned kRandomScenes = 10000;

// How far a point is from everything that a robot's rays can meet; 0 inside.
double free_distance(const Scene& scene, const Snapshot& now, unsigned robot, double x, double y) {
    double nearest = scene.arena.size / 2 - std::max(std::abs(x), std::abs(y));
    for (unsigned i = 0; i < now.robots.size(); ++i)
        if (i != robot)
            nearest = std::min(nearest, std::hypot(x - now.robots[i].x, y - now.robots[i].y) - scene.robot.radius);
    if (scene.sensors.infrared_target == SWE_INFRARED_TARGET_ALL) {
        const double c = std::cos(now.box.heading), s = std::sin(now.box.heading);
        const double bx = x - now.box.x, by = y - now.box.y;
        nearest = std::min(nearest, std::hypot(std::max(0.0, std::abs(c * bx + s * by) - scene.box.size[0] / 2),
                                               std::max(0.0, std::abs(c * by - s * bx) - scene.box.size[1] / 2)));
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

// Reference: the nearest of many points on the box's outline, then of many between its neighbours.
struct NearestPoint {
    double gap;      // to the robot's rim [m]
    double bearing;  // from the robot's heading [rad]
};

NearestPoint nearest_on_outline(const Scene& scene, const Pose& robot, const Pose& box) {
    const double width = scene.box.size[0], depth = scene.box.size[1], around = 2 * (width + depth);
    double x = 0, y = 0;
    const auto distance_at = [&](double along) {
        along = std::fmod(along + around, around);
        double px = width / 2, py = depth / 2;  // on the box, from its first corner counter-clockwise
        px -= std::clamp(along, 0.0, width) - std::clamp(along - width - depth, 0.0, width);
        py -= std::clamp(along - width, 0.0, depth) - std::clamp(along - 2 * width - depth, 0.0, depth);
        x = box.x + std::cos(box.heading) * px - std::sin(box.heading) * py - robot.x;
        y = box.y + std::sin(box.heading) * px + std::cos(box.heading) * py - robot.y;
        return std::hypot(x, y);
    };
    double best = 0, half_span = around / 2;
    for (int level = 0; level < 4; ++level) {
        constexpr int points = 200;
        const double centre = best;
        double nearest = std::numeric_limits<double>::infinity();
        for (int i = -points; i <= points; ++i) {
            const double along = centre + half_span * i / points, distance = distance_at(along);
            if (distance < nearest) nearest = distance, best = along;
        }
        half_span *= 2.0 / points;
    }
    const double distance = distance_at(best);
    return {distance - scene.robot.radius, std::remainder(std::atan2(y, x) - robot.heading, 2 * kPi)};
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
        unsigned met = 0, edges = 0;
        double worst = 0;
        for (unsigned number = 0; number < kRandomScenes; ++number) {
            const Snapshot now = random_snapshot(scene, number);
            const unsigned robot = number % scene.robots;
            const Pose& me = now.robots[robot];
            for (unsigned sensor = 0; sensor < SWE_INFRARED_SENSORS; ++sensor) {
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

TEST_CASE("touch sensors agree with the nearest of many points on the box") {
    Fixture fixture;
    fixture.config.sensors.touch_mode = SWE_TOUCH_MODE_GRADED;
    const Scene scene = fixture.scene();
    const double range = scene.sensors.touch_range, half_width = scene.sensors.touch_half_width_deg * kRadiansPerDegree;
    unsigned touched = 0;
    for (unsigned number = 0; number < kRandomScenes; ++number) {
        // Somewhere around the box, from touching it to twice the range away.
        const auto w = draw({97, 0, number, 0}, Purpose::start, 0, 0);
        const Pose box = {0.1 * symmetric(w[0]), 0.1 * symmetric(w[1]), kPi * symmetric(w[2])};
        const auto u = draw({96, 0, number, 0}, Purpose::start, 0, 0);
        Pose robot = {box.x + 0.3 * std::cos(2 * kPi * uniform(u[0])), box.y + 0.3 * std::sin(2 * kPi * uniform(u[0])),
                      kPi * symmetric(u[1])};
        const NearestPoint far = nearest_on_outline(scene, robot, box);
        const double approach = far.gap - 2 * range * uniform(u[2]);
        robot.x += approach * std::cos(robot.heading + far.bearing);
        robot.y += approach * std::sin(robot.heading + far.bearing);

        const NearestPoint nearest = nearest_on_outline(scene, robot, box);
        const double expected = nearest.gap <= range ? 1 - std::max(0.0, nearest.gap) / range : 0;
        double readings[SWE_TOUCH_SENSORS];
        sense_touch(scene, {{robot}, box}, 0, 0, readings);
        for (unsigned sensor = 0; sensor < SWE_TOUCH_SENSORS; ++sensor) {
            const double centre = scene.sensors.touch_yaw_deg[sensor] * kRadiansPerDegree;
            const double off = std::abs(std::remainder(nearest.bearing - centre, 2 * kPi));
            if (std::abs(off - half_width) < 1e-3) continue;  // on the sector's edge, within the reference's precision
            touched += readings[sensor] > 0;
            REQUIRE(readings[sensor] == doctest::Approx(off < half_width ? expected : 0).scale(1).epsilon(1e-4));
        }
    }
    CHECK(touched > kRandomScenes / 10);
}

TEST_CASE("RF agrees with its definition") {
    const Fixture fixture;
    const Scene scene = fixture.scene();
    unsigned heard = 0;
    for (unsigned number = 0; number < kRandomScenes; ++number) {
        const auto w = draw({95, 0, number, 0}, Purpose::start, 0, 0);
        const Pose robot = {0.46 * symmetric(w[0]), 0.46 * symmetric(w[1]), 0};
        const double r = std::sqrt(std::pow(robot.x - 0, 2) + std::pow(robot.y - 0.345, 2) + std::pow(0.05 - 0.03, 2));
        const double expected = r <= 0.3 ? std::clamp(std::pow(r, -2), 1.0, 50.0) : 1;
        heard += expected > 1;
        REQUIRE(sense_rf(scene, {{robot}, {}}, kKey, 0, 0) == doctest::Approx(expected).epsilon(1e-12));
        REQUIRE(in_emitter_range(scene, robot) == (r <= 0.3));
    }
    CHECK(heard > kRandomScenes / 10);
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
    CHECK(ray_to_walls(0.51, 0, 1, 0, 0.5) == 0);                           // pressed a little into the wall
    CHECK(ray_to_disc(0, 1.001, 1, 0, 3, 0, 1) == infinity);                // just past it
    CHECK(ray_to_disc(0, 0, 1, 0, 1, 0, 1) == 0);                           // starts on its rim
    CHECK(ray_to_rectangle(-2, 1.001, 1, 0, {0, 0, 0}, 1, 1) == infinity);  // just past an edge
    CHECK(ray_to_rectangle(-1, 0, 1, 0, {0, 0, 0}, 1, 1) == 0);             // starts on an edge
    CHECK(ray_to_rectangle(-1, 0, 0, 1, {0, 0, 0}, 1, 1) == 0);             // starts on an edge and runs along it
    CHECK(ray_to_walls(0.5, 0.5, 1, 0, 0.5) == 0);                          // starts in a corner
    CHECK(ray_to_walls(0, 0.5, 1, 0, 0.5) == doctest::Approx(0.5));         // runs along a wall
}

TEST_CASE("sensors in odd places: in a corner, inside the box, on top of another robot") {
    Fixture fixture;
    fixture.config.sensors.infrared_target = SWE_INFRARED_TARGET_ALL;
    const Scene scene = fixture.scene();
    const double room = scene.arena.size / 2 - scene.robot.radius;
    // Touching two walls, heading along one: ps2 looks straight right.
    const Snapshot corner{{{room, -room, 0}}, {0, 0.345, 0}};
    CHECK(infrared_distance(scene, corner, 0, 2) == doctest::Approx(0).scale(1).epsilon(1e-12));
    CHECK(std::isinf(infrared_distance(scene, corner, 0, 5)));  // ps5 looks left, into the open

    double readings[SWE_TOUCH_SENSORS];
    const Snapshot inside{{{0.01, 0.345, 0}}, {0, 0.345, 0}};  // its centre in the box: physics never lets it
    sense_touch(scene, inside, 0, 0, readings);
    for (const double reading : readings) CHECK((reading == 0 || reading == 1));
    for (unsigned sensor = 0; sensor < SWE_INFRARED_SENSORS; ++sensor)
        CHECK(infrared_distance(scene, inside, 0, sensor) == 0);

    const Snapshot stacked{{{0, 0, 0}, {0.01, 0, 1}}, {0, 0.345, 0}};
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

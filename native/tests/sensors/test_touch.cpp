// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "epuck.hpp"
#include "fixture.hpp"
#include "sensors/touch.hpp"

using namespace swarmevo;

namespace {

constexpr EpisodeKey kKey = {1, 0, 0, 0};

constexpr unsigned kRandomScenes = 10000;

// Reference: the nearest of many points on the box's outline, then of many between its neighbours.
struct NearestPoint {
    double gap;      // to the robot's rim [m]
    double bearing;  // from the robot's heading [rad]
};

NearestPoint nearest_on_outline(const Scene& scene, const Pose& robot, const Pose& box) {
    const double width = scene.movables[0].config.size[0], depth = scene.movables[0].config.size[1],
                 around = 2 * (width + depth);
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
    const double y = scene.movables[0].config.pose[1] - scene.movables[0].config.size[1] / 2 - scene.robot.radius - gap;
    const Snapshot now{
        {{0, y, heading}}, {{scene.movables[0].config.pose[0], scene.movables[0].config.pose[1], 0}}, {force}};
    double readings[4];
    sense_touch({scene, now, kKey, 0, 0}, readings);
    return readings[sensor];
}

}  // namespace

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
        double readings[4];
        sense_touch({scene, {{robot}, {box}, {}}, kKey, 0, 0}, readings);
        for (unsigned sensor = 0; sensor < 4; ++sensor) {
            const double centre = scene.sensors.touch_yaw_deg[sensor] * kRadiansPerDegree;
            const double off = std::abs(std::remainder(nearest.bearing - centre, 2 * kPi));
            if (std::abs(off - half_width) < 1e-3) continue;  // on the sector's edge, within the reference's precision
            touched += readings[sensor] > 0;
            REQUIRE(readings[sensor] == doctest::Approx(off < half_width ? expected : 0).scale(1).epsilon(1e-4));
        }
    }
    CHECK(touched > kRandomScenes / 10);
}

TEST_CASE("touch sensors of a robot whose centre is inside the box answer or do not") {
    const Fixture fixture;
    const Scene scene = fixture.scene();
    double readings[4];
    const Snapshot inside{{{0.01, 0.345, 0}}, {{0, 0.345, 0}}, {}};  // physics never lets it
    sense_touch({scene, inside, kKey, 0, 0}, readings);
    for (const double reading : readings) CHECK((reading == 0 || reading == 1));
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

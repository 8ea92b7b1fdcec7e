// SPDX-License-Identifier: BSD-3-Clause
#include "sensors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "epuck.hpp"

namespace swarmevo {
namespace {

constexpr double kNothing = std::numeric_limits<double>::infinity();

double square(double x) {
    return x * x;
}

double distance_to_emitter_squared(const Scene& scene, const Pose& robot) {
    return square(robot.x - scene.emitter.position[0]) + square(robot.y - scene.emitter.position[1]) +
           square(scene.robot.height - scene.emitter.position[2]);
}

double infrared_range(const Scene& scene) {
    return scene.sensors.infrared_curve[scene.sensors.infrared_curve_points - 1][0];
}

// What the rays of one robot can meet: most robots are in the open most of the time.
struct Surroundings {
    std::array<const Pose*, SWE_MAX_ROBOTS> robots;
    unsigned n_robots = 0;
    bool walls = false, box = false;

    bool empty() const { return n_robots == 0 && !walls && !box; }
};

// Within `reach` of its centre.
Surroundings surroundings_of(const Scene& scene, const Snapshot& now, unsigned robot, double reach) {
    const Pose& me = now.robots[robot];
    Surroundings around;
    around.walls = std::max(std::abs(me.x), std::abs(me.y)) + reach > scene.arena.size / 2;
    const double limit = square(reach + scene.robot.radius);
    for (unsigned i = 0; i < now.robots.size(); ++i)
        if (i != robot && square(now.robots[i].x - me.x) + square(now.robots[i].y - me.y) < limit)
            around.robots[around.n_robots++] = &now.robots[i];
    if (scene.sensors.infrared_target == SWE_INFRARED_TARGET_ALL) {
        const double half_diagonal = std::hypot(scene.box.size[0], scene.box.size[1]) / 2;
        around.box = square(now.box.x - me.x) + square(now.box.y - me.y) < square(reach + half_diagonal);
    }
    return around;
}

double nearest_hit(const Scene& scene, const Snapshot& now, const Surroundings& around, double x, double y, double dx,
                   double dy) {
    double distance = kNothing;
    if (around.walls) distance = ray_to_walls(x, y, dx, dy, scene.arena.size / 2);
    for (unsigned i = 0; i < around.n_robots; ++i)
        distance =
            std::min(distance, ray_to_disc(x, y, dx, dy, around.robots[i]->x, around.robots[i]->y, scene.robot.radius));
    if (around.box)
        distance =
            std::min(distance, ray_to_rectangle(x, y, dx, dy, now.box, scene.box.size[0] / 2, scene.box.size[1] / 2));
    return distance <= infrared_range(scene) ? distance : kNothing;
}

// The sensors sit on the body's rim and look straight out.
std::array<double, SWE_INFRARED_SENSORS> distances_of(const Scene& scene, const Snapshot& now, unsigned robot) {
    std::array<double, SWE_INFRARED_SENSORS> distances;
    distances.fill(kNothing);
    const Surroundings around = surroundings_of(scene, now, robot, scene.robot.radius + infrared_range(scene));
    if (around.empty()) return distances;
    const Pose& me = now.robots[robot];
    const double cosine = std::cos(me.heading), sine = std::sin(me.heading), radius = scene.robot.radius;
    for (unsigned sensor = 0; sensor < SWE_INFRARED_SENSORS; ++sensor) {
        const Scene::Direction ray = scene.infrared_rays[sensor];
        const double dx = cosine * ray.x - sine * ray.y, dy = sine * ray.x + cosine * ray.y;
        distances[sensor] = nearest_hit(scene, now, around, me.x + radius * dx, me.y + radius * dy, dx, dy);
    }
    return distances;
}

// Relative standard deviation of a reading: grows from contact to the curve's second point, constant from there.
double infrared_deviation(const Scene& scene, double distance) {
    const double share = std::min(1.0, distance / scene.sensors.infrared_curve[1][0]);
    return scene.noise.infrared_at_contact + share * (scene.noise.infrared - scene.noise.infrared_at_contact);
}

double angle_between(double a, double b) {
    return std::abs(std::remainder(a - b, 2 * kPi));
}

}  // namespace

double ray_to_walls(double x, double y, double dx, double dy, double half_size) {
    const double to_x = dx > 0 ? (half_size - x) / dx : dx < 0 ? (-half_size - x) / dx : kNothing;
    const double to_y = dy > 0 ? (half_size - y) / dy : dy < 0 ? (-half_size - y) / dy : kNothing;
    return std::max(0.0, std::min(to_x, to_y));
}

double ray_to_disc(double x, double y, double dx, double dy, double cx, double cy, double radius) {
    const double ox = cx - x, oy = cy - y;
    const double centre_squared = ox * ox + oy * oy;
    if (centre_squared <= radius * radius) return 0;
    const double along = ox * dx + oy * dy;  // to the point nearest to the centre
    if (along <= 0) return kNothing;
    const double half_chord_squared = radius * radius - square(ox * dy - oy * dx);
    if (half_chord_squared < 0) return kNothing;
    return along - std::sqrt(half_chord_squared);
}

double ray_to_rectangle(double x, double y, double dx, double dy, const Pose& pose, double half_x, double half_y) {
    // In the rectangle's frame the ray is inside where it is inside both slabs.
    const double cosine = std::cos(pose.heading), sine = std::sin(pose.heading);
    const double origin[2] = {cosine * (x - pose.x) + sine * (y - pose.y), cosine * (y - pose.y) - sine * (x - pose.x)};
    const double direction[2] = {cosine * dx + sine * dy, cosine * dy - sine * dx};
    const double half[2] = {half_x, half_y};
    double enter = 0, leave = kNothing;
    for (int i = 0; i < 2; ++i) {
        if (direction[i] == 0) {
            if (std::abs(origin[i]) > half[i]) return kNothing;
            continue;
        }
        const double side = std::copysign(half[i], direction[i]);
        enter = std::max(enter, (-side - origin[i]) / direction[i]);
        leave = std::min(leave, (side - origin[i]) / direction[i]);
    }
    return enter <= leave ? enter : kNothing;
}

double infrared_distance(const Scene& scene, const Snapshot& now, unsigned robot, unsigned sensor) {
    return distances_of(scene, now, robot)[sensor];
}

double infrared_response(const swe_sensors_config& sensors, double distance) {
    const auto& curve = sensors.infrared_curve;
    if (distance <= curve[0][0]) return 1;
    for (unsigned i = 1; i < sensors.infrared_curve_points; ++i)
        if (distance <= curve[i][0]) {
            const double share = (distance - curve[i - 1][0]) / (curve[i][0] - curve[i - 1][0]);
            return (curve[i - 1][1] + share * (curve[i][1] - curve[i - 1][1])) / curve[0][1];
        }
    return 0;
}

void sense_infrared(const Scene& scene, const Snapshot& now, const EpisodeKey& key, unsigned step, unsigned robot,
                    double readings[SWE_INFRARED_SENSORS]) {
    std::fill_n(readings, SWE_INFRARED_SENSORS, 0.0);
    const auto distances = distances_of(scene, now, robot);
    for (unsigned sensor = 0; sensor < SWE_INFRARED_SENSORS; ++sensor) {
        const double distance = distances[sensor];
        double reading = infrared_response(scene.sensors, distance);
        if (reading == 0) continue;
        const auto words = draw(key, Purpose::infrared, robot, step, sensor);
        reading *= 1 + infrared_deviation(scene, distance) * normal(words[0], words[1]);
        readings[sensor] = std::clamp(reading, 0.0, 1.0);
    }
}

void sense_touch(const Scene& scene, const Snapshot& now, unsigned robot, double push_force,
                 double readings[SWE_TOUCH_SENSORS]) {
    std::fill_n(readings, SWE_TOUCH_SENSORS, 0.0);
    const Pose &me = now.robots[robot], &box = now.box;
    const double cosine = std::cos(box.heading), sine = std::sin(box.heading);
    const double dx = me.x - box.x, dy = me.y - box.y;
    const Separation s = separate_point_from_rectangle(cosine * dx + sine * dy, cosine * dy - sine * dx,
                                                       scene.box.size[0] / 2, scene.box.size[1] / 2);
    const double gap = s.distance - scene.robot.radius;
    if (gap > scene.sensors.touch_range) return;

    double strength = 1;
    if (scene.sensors.touch_mode == SWE_TOUCH_MODE_GRADED)
        strength = 1 - std::max(0.0, gap) / scene.sensors.touch_range;
    if (scene.sensors.touch_mode == SWE_TOUCH_MODE_FORCE) strength = std::min(1.0, push_force / traction_limit(scene));

    // The nearest point lies against the normal, which leads from the box to the robot.
    const double towards_box = std::atan2(-s.normal_y, -s.normal_x) + box.heading - me.heading;
    for (unsigned sensor = 0; sensor < SWE_TOUCH_SENSORS; ++sensor) {
        const double centre = scene.sensors.touch_yaw_deg[sensor] * kRadiansPerDegree;
        if (angle_between(towards_box, centre) <= scene.sensors.touch_half_width_deg * kRadiansPerDegree)
            readings[sensor] = strength;
    }
}

bool in_emitter_range(const Scene& scene, const Pose& robot) {
    return distance_to_emitter_squared(scene, robot) <= square(scene.emitter.range);
}

double sense_rf(const Scene& scene, const Snapshot& now, const EpisodeKey& key, unsigned step, unsigned robot) {
    const Pose& me = now.robots[robot];
    const double least = scene.emitter.strength[0], most = scene.emitter.strength[1];
    if (scene.emitter.reach == SWE_REACH_RANGE && !in_emitter_range(scene, me)) return least;
    double strength = 1 / std::max(distance_to_emitter_squared(scene, me), std::numeric_limits<double>::min());
    if (scene.noise.rf > 0) {
        const auto words = draw(key, Purpose::rf, robot, step);
        strength *= 1 + scene.noise.rf * normal(words[0], words[1]);
    }
    return std::clamp(strength, least, most);
}

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
#include "sensors/infrared.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "scene/scene.hpp"

namespace swarmevo {
namespace {

double infrared_range(const Scene& scene) {
    return scene.sensors.infrared_curve[scene.sensors.infrared_curve_points - 1][0];
}

// What the rays of one robot can meet: most robots are in the open most of the time.
struct Surroundings {
    std::array<const Pose*, SWE_MAX_ROBOTS> robots;
    std::array<const Wall*, SWE_MAX_CORNERS> walls;
    std::array<unsigned, SWE_MAX_MOVABLES> movables;
    std::array<unsigned, SWE_MAX_OBSTACLES> obstacles;
    unsigned n_robots = 0, n_walls = 0, n_movables = 0, n_obstacles = 0;
    bool round_wall = false;

    bool empty() const { return n_robots + n_walls + n_movables + n_obstacles == 0 && !round_wall; }
};

// Within `reach` of its centre.
Surroundings surroundings_of(const Scene& scene, const Snapshot& now, unsigned robot, double reach) {
    const Pose& me = now.robots[robot];
    Surroundings around;
    around.round_wall = scene.arena.is_round() && scene.arena.distance(me.x, me.y) < reach;
    for (const Wall& wall : scene.arena.walls())
        if (wall.distance(me.x, me.y) < reach) around.walls[around.n_walls++] = &wall;
    const double limit = square(reach + scene.robot.radius);
    for (unsigned i = 0; i < now.robots.size(); ++i)
        if (i != robot && square(now.robots[i].x - me.x) + square(now.robots[i].y - me.y) < limit)
            around.robots[around.n_robots++] = &now.robots[i];
    const auto is_near = [&](const Figure& figure, const Pose& pose) {
        return square(pose.x - me.x) + square(pose.y - me.y) < square(reach + figure.reach);
    };
    for (unsigned i = 0; i < scene.obstacles.size(); ++i)
        if (is_near(scene.obstacles[i].figure, scene.obstacles[i].pose)) around.obstacles[around.n_obstacles++] = i;
    if (scene.sensors.infrared_target == SWE_INFRARED_TARGET_ALL)
        for (unsigned i = 0; i < now.movables.size(); ++i)
            if (is_near(scene.movables[i].figure, now.movables[i])) around.movables[around.n_movables++] = i;
    return around;
}

double nearest_hit(const Scene& scene, const Snapshot& now, const Surroundings& around, double x, double y, double dx,
                   double dy) {
    double distance = kNothing;
    if (around.round_wall) distance = ray_to_ring(scene.arena.round_radius(), x, y, dx, dy);
    for (unsigned i = 0; i < around.n_walls; ++i)
        distance = std::min(distance, ray_to_wall(*around.walls[i], x, y, dx, dy));
    for (unsigned i = 0; i < around.n_robots; ++i)
        distance =
            std::min(distance, ray_to_disc(x, y, dx, dy, around.robots[i]->x, around.robots[i]->y, scene.robot.radius));
    for (unsigned i = 0; i < around.n_movables; ++i) {
        const unsigned seen = around.movables[i];
        distance = std::min(distance, ray_to_figure(x, y, dx, dy, scene.movables[seen].figure, now.movables[seen]));
    }
    for (unsigned i = 0; i < around.n_obstacles; ++i) {
        const Obstacle& seen = scene.obstacles[around.obstacles[i]];
        distance = std::min(distance, ray_to_figure(x, y, dx, dy, seen.figure, seen.pose));
    }
    return distance <= infrared_range(scene) ? distance : kNothing;
}

// The sensors sit on the body's rim and look straight out.
using Distances = std::array<double, SWE_MAX_INFRARED>;
Distances distances_of(const Scene& scene, const Snapshot& now, unsigned robot) {
    Distances distances;
    std::fill_n(distances.begin(), scene.sensors.infrared_count, kNothing);
    const Surroundings around = surroundings_of(scene, now, robot, scene.robot.radius + infrared_range(scene));
    if (around.empty()) return distances;
    const Pose& me = now.robots[robot];
    const double cosine = std::cos(me.heading), sine = std::sin(me.heading), radius = scene.robot.radius;
    for (unsigned sensor = 0; sensor < scene.sensors.infrared_count; ++sensor) {
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

unsigned width(const swe_scene_config& checked) {
    return checked.sensors.infrared_count;
}

}  // namespace

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

void sense_infrared(const Glimpse& glimpse, double* readings) {
    const Scene& scene = glimpse.scene;
    const unsigned sensors = scene.sensors.infrared_count;
    std::fill_n(readings, sensors, 0.0);
    const Distances distances = distances_of(scene, glimpse.now, glimpse.robot);
    for (unsigned sensor = 0; sensor < sensors; ++sensor) {
        const double distance = distances[sensor];
        if (distance == kNothing) continue;
        double reading = infrared_response(scene.sensors, distance);
        if (reading == 0) continue;
        const auto words = glimpse.draw(Purpose::infrared, sensor);
        reading *= 1 + infrared_deviation(scene, distance) * normal(words[0], words[1]);
        readings[sensor] = std::clamp(reading, 0.0, 1.0);
    }
}

const Device kInfrared = {SWE_SENSOR_INFRARED, width, sense_infrared};

}  // namespace swarmevo

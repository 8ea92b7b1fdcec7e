// SPDX-License-Identifier: BSD-3-Clause
// What sprung bumpers hold, from where bodies stand.
#pragma once

#include <algorithm>
#include <cmath>

#include "scene/scene.hpp"
#include "world/world.hpp"

namespace swarmevo {

// Energy of all bumpers [J].
inline double bumper_energy(const World& world, const Scene& scene) {
    if (scene.robot.bumper == SWE_BUMPER_RIGID) return 0;
    const double stiffness = scene.robot.bumper_stiffness, radius = scene.robot.radius, wall = scene.arena.bounds()[1];
    double energy = 0;
    const auto add = [&](double gap, double k) { energy += k * std::pow(std::min(gap, 0.0), 2) / 2; };
    const Pose box = world.movable_pose(0);
    const swe_movable_config& pushed = scene.movables[0].config;
    const double cosine = std::cos(box.heading), sine = std::sin(box.heading);
    for (unsigned i = 0; i < scene.robots; ++i) {
        const Pose robot = world.robot_pose(i);
        for (const double to_wall : {wall - robot.x, wall + robot.x, wall - robot.y, wall + robot.y})
            add(to_wall - radius, stiffness);
        for (unsigned j = 0; j < i; ++j) {
            const Pose other = world.robot_pose(j);
            add(std::hypot(robot.x - other.x, robot.y - other.y) - 2 * radius, stiffness / 2);  // in series
        }
        const double dx = robot.x - box.x, dy = robot.y - box.y;
        const double half_x = pushed.size[0] / 2, half_y = pushed.size[1] / 2;
        const double distance =
            pushed.shape == SWE_SHAPE_CYLINDER
                ? std::hypot(dx, dy) - half_x
                : separate_point_from_rectangle(cosine * dx + sine * dy, cosine * dy - sine * dx, half_x, half_y)
                      .distance;
        add(distance - radius, stiffness);
    }
    return energy;
}

}  // namespace swarmevo

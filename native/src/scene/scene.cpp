// SPDX-License-Identifier: BSD-3-Clause
#include "scene/scene.hpp"

#include <algorithm>
#include <cmath>

#include "scene/validation.hpp"

namespace swarmevo {
namespace {

std::vector<Pose> copy_poses(const swe_team_config& team) {
    std::vector<Pose> poses;
    if (team.start == SWE_START_POSES)
        for (unsigned i = 0; i < team.robots; ++i)
            poses.push_back({team.start_poses[3 * i], team.start_poses[3 * i + 1], team.start_poses[3 * i + 2]});
    return poses;
}

std::vector<Scene::Direction> directions(const double* yaw_deg, unsigned n) {
    std::vector<Scene::Direction> rays;
    for (unsigned i = 0; i < n; ++i)
        rays.push_back({std::cos(yaw_deg[i] * kRadiansPerDegree), std::sin(yaw_deg[i] * kRadiansPerDegree)});
    return rays;
}

unsigned ratio(double whole, double part) {
    return static_cast<unsigned>(std::lround(whole / part));
}

}  // namespace

Scene::Scene(const swe_scene_config& config)
    : arena(checked(config).arena),
      box(config.box),
      emitter(config.emitter),
      robot(config.robot),
      team(config.team),
      sensors(config.sensors),
      noise(config.noise),
      physics(config.physics),
      episode(config.episode),
      start_poses(copy_poses(config.team)),
      infrared_rays(directions(config.sensors.infrared_yaw_deg, config.sensors.infrared_count)),
      suite(config),
      commands(2),
      robots(config.team.robots),
      control_steps(ratio(config.episode.horizon, config.episode.control_period)),
      substeps(ratio(config.episode.control_period, config.physics.time_step)) {}

Separation separate_point_from_rectangle(double x, double y, double half_x, double half_y) {
    const double nearest_x = std::clamp(x, -half_x, half_x), nearest_y = std::clamp(y, -half_y, half_y);
    const double dx = x - nearest_x, dy = y - nearest_y;
    const double distance = std::sqrt(dx * dx + dy * dy);
    if (distance > 0) return {distance, nearest_x, nearest_y, dx / distance, dy / distance};
    // Inside: the shortest way out leads through the nearest edge.
    const double depth_x = half_x - std::abs(x), depth_y = half_y - std::abs(y);
    if (depth_x < depth_y) return {-depth_x, std::copysign(half_x, x), y, std::copysign(1.0, x), 0};
    return {-depth_y, x, std::copysign(half_y, y), 0, std::copysign(1.0, y)};
}

}  // namespace swarmevo

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

std::vector<MovableKind> movables_of(const swe_scene_config& config) {
    std::vector<MovableKind> movables;
    for (unsigned i = 0; i < config.n_movables; ++i) {
        const swe_movable_config& movable = config.movables[i];
        movables.push_back({movable, Figure::of(movable.shape, movable.size[0], movable.size[1], movable.size[2])});
    }
    return movables;
}

std::vector<Obstacle> obstacles_of(const swe_scene_config& config) {
    std::vector<Obstacle> obstacles;
    for (unsigned i = 0; i < config.n_obstacles; ++i) {
        const swe_obstacle_config& obstacle = config.obstacles[i];
        obstacles.push_back({Figure::of(obstacle.shape, obstacle.size[0], obstacle.size[1], obstacle.size[2]),
                             {obstacle.pose[0], obstacle.pose[1], obstacle.pose[2]}});
    }
    return obstacles;
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
      movables(movables_of(config)),
      obstacles(obstacles_of(config)),
      emitters(config.emitters, config.emitters + config.n_emitters),
      ground(config.ground),
      goals(config.goals, config.goals + config.n_goals),
      robot(config.robot),
      team(config.team),
      sensors(config.sensors),
      noise(config.noise),
      physics(config.physics),
      episode(config.episode),
      start_poses(copy_poses(config.team)),
      infrared_rays(directions(config.sensors.infrared_yaw_deg, config.sensors.infrared_count)),
      suite(config),
      message_bits(suite.place_of(SWE_SENSOR_RANGE_AND_BEARING) < 0 ? 0 : config.sensors.range_and_bearing_message),
      commands(2 + message_bits),
      robots(config.team.robots),
      control_steps(ratio(config.episode.horizon, config.episode.control_period)),
      substeps(ratio(config.episode.control_period, config.physics.time_step)) {}

}  // namespace swarmevo

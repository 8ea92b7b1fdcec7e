// SPDX-License-Identifier: BSD-3-Clause
// The immutable description of an experiment's world. Validated once, then shared by all threads.
#pragma once

#include <string>
#include <vector>

#include "scene/figure.hpp"
#include "sensors/suite.hpp"
#include "swarmevo.h"

namespace swarmevo {

constexpr double kPi = 3.14159265358979323846;
constexpr double kRadiansPerDegree = kPi / 180;

// What robots can push.
struct MovableKind {
    swe_movable_config config;
    Figure figure;
};

// What never moves.
struct Obstacle {
    Figure figure;
    Pose pose;
};

// How something moves on the floor.
struct Twist {
    double x, y;  // [m/s]
    double spin;  // [rad/s]
};

class Scene {
  public:
    // Throws Error(SWE_INVALID_ARGUMENT) with all that is wrong, separated by "; ".
    explicit Scene(const swe_scene_config& config);

    const Arena arena;
    const std::vector<MovableKind> movables;
    const std::vector<Obstacle> obstacles;
    const std::vector<swe_emitter_config> emitters;
    const swe_ground_config ground;
    const std::vector<swe_goal_config> goals;
    const swe_robot_config robot;
    const swe_team_config team;  // its start_poses pointer is the caller's: use start_poses below
    const swe_sensors_config sensors;
    const swe_noise_config noise;
    const swe_physics_config physics;
    const swe_episode_config episode;

    // Derived once.
    const std::vector<Pose> start_poses;  // empty if starts are random
    struct Direction {
        double x, y;  // of a unit vector in the robot's own frame
    };
    const std::vector<Direction> infrared_rays;
    const SensorSuite suite;      // of each robot
    const unsigned message_bits;  // that each robot sends
    const unsigned commands;      // that each robot is told
    const unsigned robots;
    const unsigned control_steps;  // in an episode
    const unsigned substeps;       // time steps in a control step
};

}  // namespace swarmevo

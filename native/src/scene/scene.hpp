// SPDX-License-Identifier: BSD-3-Clause
// The immutable description of an experiment's world. Validated once, then shared by all threads.
#pragma once

#include <string>
#include <vector>

#include "sensors/suite.hpp"
#include "swarmevo.h"

namespace swarmevo {

constexpr double kPi = 3.14159265358979323846;
constexpr double kRadiansPerDegree = kPi / 180;

// Position on the floor [m] and heading [rad].
struct Pose {
    double x, y, heading;
};

class Scene {
  public:
    // Throws Error(SWE_INVALID_ARGUMENT) with all that is wrong, separated by "; ".
    explicit Scene(const swe_scene_config& config);

    const swe_arena_config arena;
    const swe_box_config box;
    const swe_emitter_config emitter;
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
    const SensorSuite suite;  // of each robot
    const unsigned commands;  // that each robot is told
    const unsigned robots;
    const unsigned control_steps;  // in an episode
    const unsigned substeps;       // time steps in a control step
};

// Distance from a point to a rectangle (half extents, centred at the origin) and the direction that leads out of it.
struct Separation {
    double distance;              // negative inside [m]
    double nearest_x, nearest_y;  // on the rectangle's edge [m]
    double normal_x, normal_y;    // unit vector from the edge towards the point
};
Separation separate_point_from_rectangle(double x, double y, double half_x, double half_y);

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
// What a robot perceives: pure functions of geometry and random draws.
#pragma once

#include <vector>

#include "rng.hpp"
#include "scene/scene.hpp"

namespace swarmevo {

// Everything that sensors need to know about a moment.
struct Snapshot {
    std::vector<Pose> robots;
    Pose box;
};

// ---- geometry: distances along a ray from (x, y) in the unit direction (dx, dy) [m]; infinity where nothing is hit
// ----

// To the walls of a square arena of the given half size, from inside.
double ray_to_walls(double x, double y, double dx, double dy, double half_size);

// To a disc at (cx, cy). 0 from inside.
double ray_to_disc(double x, double y, double dx, double dy, double cx, double cy, double radius);

// To a rectangle turned by its pose's heading. 0 from inside.
double ray_to_rectangle(double x, double y, double dx, double dy, const Pose& pose, double half_x, double half_y);

// ---- sensors -------------------------------------------------------------------------------------------------------

// Distance that one infrared sensor of a robot measures, without noise [m]; infinity where nothing is in range.
double infrared_distance(const Scene& scene, const Snapshot& now, unsigned robot, unsigned sensor);

// Reading in [0, 1] for a distance: the curve, linear in between, over its first value; 0 beyond its end.
double infrared_response(const swe_sensors_config& sensors, double distance);

// All infrared readings of a robot, with noise, clipped to [0, 1].
void sense_infrared(const Scene& scene, const Snapshot& now, const EpisodeKey& key, unsigned step, unsigned robot,
                    double readings[SWE_INFRARED_SENSORS]);

// Touch readings in [0, 1]: a sector answers to the nearest point of the box.
// push_force: normal force on the box [N], used by SWE_TOUCH_MODE_FORCE alone.
void sense_touch(const Scene& scene, const Snapshot& now, unsigned robot, double push_force,
                 double readings[SWE_TOUCH_SENSORS]);

// Is the emitter within its range of the robot's receiver, on top of the robot's centre?
bool in_emitter_range(const Scene& scene, const Pose& robot);

// Signal strength S = 1 / r^2 within its limits, with noise. Paper eq. 1: S = [1, 50].
double sense_rf(const Scene& scene, const Snapshot& now, const EpisodeKey& key, unsigned step, unsigned robot);

}  // namespace swarmevo

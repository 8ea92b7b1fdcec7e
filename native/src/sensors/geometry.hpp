// SPDX-License-Identifier: BSD-3-Clause
// Distances along a ray from (x, y) in the unit direction (dx, dy) [m]; infinity where nothing is hit.
#pragma once

#include <limits>

#include "scene/scene.hpp"

namespace swarmevo {

constexpr double kNothing = std::numeric_limits<double>::infinity();

inline double square(double x) {
    return x * x;
}

// To the walls of a square arena of the given half size, from inside.
double ray_to_walls(double x, double y, double dx, double dy, double half_size);

// To a disc at (cx, cy). 0 from inside.
double ray_to_disc(double x, double y, double dx, double dy, double cx, double cy, double radius);

// To a rectangle turned by its pose's heading. 0 from inside.
double ray_to_rectangle(double x, double y, double dx, double dy, const Pose& pose, double half_x, double half_y);

}  // namespace swarmevo

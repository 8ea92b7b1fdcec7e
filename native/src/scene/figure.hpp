// SPDX-License-Identifier: BSD-3-Clause
// Outlines on the floor: discs, rectangles, and the arena's walls round them; distances and rays in closed form.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "swarmevo.h"

namespace swarmevo {

constexpr double kNothing = std::numeric_limits<double>::infinity();  // how far to what is not there [m]

inline double square(double x) {
    return x * x;
}

// Position on the floor [m] and heading [rad].
struct Pose {
    double x, y, heading;
};

// Distance from a point to an outline and the direction that leads out of it.
struct Separation {
    double distance;              // negative inside [m]
    double nearest_x, nearest_y;  // on the edge [m]
    double normal_x, normal_y;    // unit vector from the edge towards the point
};

// A rectangle with these half extents, centred at the origin.
Separation separate_point_from_rectangle(double x, double y, double half_x, double half_y);

// A disc or a rectangle about its own middle, upright from the floor to its height.
struct Figure {
    bool is_round;
    double half_x, half_y;  // of its extent; both the radius where it is round [m]
    double height;          // [m]
    double reach;           // from the middle to the farthest point of the edge [m]

    static Figure of(std::int32_t shape, double size_x, double size_y, double height);

    // In its own frame.
    Separation separate(double x, double y) const;
};

// Distance of a point of the floor from a figure; negative inside [m].
double distance(const Figure& figure, const Pose& pose, double x, double y);

// Between two figures [m]; negative where they overlap.
double distance(const Figure& first, const Pose& first_pose, const Figure& second, const Pose& second_pose);

// A straight wall: all that is in the arena lies where offset + normal . point > 0.
struct Wall {
    double normal_x, normal_y;  // unit vector into the arena
    double offset;              // [m]

    double distance(double x, double y) const { return offset + normal_x * x + normal_y * y; }
};

// The floor and the walls round it.
class Arena {
  public:
    explicit Arena(const swe_arena_config& config);

    // Straight ones: of a rectangle to the east, west, north and south, in this order. None where it is round.
    const std::vector<Wall>& walls() const { return walls_; }
    bool is_round() const { return round_radius_ > 0; }
    double round_radius() const { return round_radius_; }  // 0 where it is not round [m]
    double wall_height() const { return wall_height_; }

    // Of a point from the nearest wall, negative outside [m].
    double distance(double x, double y) const;

    // Of a figure from the walls; negative where it does not fit [m].
    double distance(const Figure& figure, const Pose& pose) const;

    // x from, x to, y from, y to of what the walls enclose [m].
    const double* bounds() const { return bounds_; }

  private:
    std::vector<Wall> walls_;
    double round_radius_ = 0, wall_height_;
    double bounds_[4];
};

// ---- rays: how far from (x, y) in the unit direction (dx, dy) [m]; infinity where nothing is hit -------------------

// From inside the arena to a straight wall. 0 from behind it.
double ray_to_wall(const Wall& wall, double x, double y, double dx, double dy);

// From inside the arena to its round wall, about the origin. 0 from outside.
double ray_to_ring(double radius, double x, double y, double dx, double dy);

// 0 from inside the figure.
double ray_to_figure(double x, double y, double dx, double dy, const Figure& figure, const Pose& pose);

// To a disc at (cx, cy). 0 from inside.
double ray_to_disc(double x, double y, double dx, double dy, double cx, double cy, double radius);

// To a rectangle turned by its pose's heading. 0 from inside.
double ray_to_rectangle(double x, double y, double dx, double dy, const Pose& pose, double half_x, double half_y);

}  // namespace swarmevo

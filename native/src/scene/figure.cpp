// SPDX-License-Identifier: BSD-3-Clause
#include "scene/figure.hpp"

#include <algorithm>
#include <cmath>

namespace swarmevo {
namespace {

// A corner of a rectangle, 0 to 3, in the world [m].
struct Point {
    double x, y;
};
Point corner(const Figure& figure, const Pose& pose, int number) {
    const double x = number & 1 ? figure.half_x : -figure.half_x, y = number & 2 ? figure.half_y : -figure.half_y;
    const double cosine = std::cos(pose.heading), sine = std::sin(pose.heading);
    return {pose.x + cosine * x - sine * y, pose.y + sine * x + cosine * y};
}

// How far the second rectangle lies beyond the sides of the first, at most; negative where no side parts them.
double beyond_sides(const Figure& first, const Pose& at, const Figure& second, const Pose& other) {
    const double cosine = std::cos(at.heading), sine = std::sin(at.heading);
    const double dx = other.x - at.x, dy = other.y - at.y;
    const double turn = other.heading - at.heading, c = std::abs(std::cos(turn)), s = std::abs(std::sin(turn));
    const double along = std::abs(cosine * dx + sine * dy), across = std::abs(cosine * dy - sine * dx);
    return std::max(along - first.half_x - c * second.half_x - s * second.half_y,
                    across - first.half_y - s * second.half_x - c * second.half_y);
}

double between_corners_and_sides(const Figure& first, const Pose& at, const Figure& second, const Pose& other) {
    double least = kNothing;
    for (int i = 0; i < 4; ++i) {
        const Point point = corner(first, at, i);
        least = std::min(least, distance(second, other, point.x, point.y));
    }
    return least;
}

}  // namespace

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

Figure Figure::of(std::int32_t shape, double size_x, double size_y, double height) {
    const double half_x = size_x / 2, half_y = size_y / 2;
    if (shape == SWE_SHAPE_CYLINDER) return {true, half_x, half_x, height, half_x};
    return {false, half_x, half_y, height, std::sqrt(size_x * size_x + size_y * size_y) / 2};
}

Separation Figure::separate(double x, double y) const {
    if (!is_round) return separate_point_from_rectangle(x, y, half_x, half_y);
    const double out = std::sqrt(x * x + y * y);
    if (out == 0) return {-half_x, half_x, 0, 1, 0};
    return {out - half_x, x / out * half_x, y / out * half_x, x / out, y / out};
}

double distance(const Figure& figure, const Pose& pose, double x, double y) {
    const double cosine = std::cos(pose.heading), sine = std::sin(pose.heading), dx = x - pose.x, dy = y - pose.y;
    return figure.separate(cosine * dx + sine * dy, cosine * dy - sine * dx).distance;
}

double distance(const Figure& first, const Pose& first_pose, const Figure& second, const Pose& second_pose) {
    if (first.is_round) return distance(second, second_pose, first_pose.x, first_pose.y) - first.half_x;
    if (second.is_round) return distance(second, second_pose, first, first_pose);
    const double beyond = std::max(beyond_sides(first, first_pose, second, second_pose),
                                   beyond_sides(second, second_pose, first, first_pose));
    if (beyond <= 0) return beyond;
    return std::min(between_corners_and_sides(first, first_pose, second, second_pose),
                    between_corners_and_sides(second, second_pose, first, first_pose));
}

Arena::Arena(const swe_arena_config& config) : wall_height_(config.wall_height) {
    const double half_x = config.size[0] / 2, half_y = config.size[1] / 2;
    bounds_[0] = -half_x;
    bounds_[1] = half_x;
    bounds_[2] = -half_y;
    bounds_[3] = half_y;
    if (config.shape == SWE_ARENA_SHAPE_CIRCLE) {
        round_radius_ = half_x;
        bounds_[2] = -half_x;
        bounds_[3] = half_x;
    } else if (config.shape == SWE_ARENA_SHAPE_RECTANGLE) {
        walls_ = {{-1, 0, half_x}, {1, 0, half_x}, {0, -1, half_y}, {0, 1, half_y}};
    } else {
        bounds_[0] = bounds_[2] = kNothing;
        bounds_[1] = bounds_[3] = -kNothing;
        for (unsigned i = 0; i < config.n_corners; ++i) {
            const double *from = config.corners[i], *to = config.corners[(i + 1) % config.n_corners];
            const double dx = to[0] - from[0], dy = to[1] - from[1], length = std::hypot(dx, dy);
            const double normal_x = -dy / length, normal_y = dx / length;  // to the left
            walls_.push_back({normal_x, normal_y, -(normal_x * from[0] + normal_y * from[1])});
            for (const int axis : {0, 1}) {
                bounds_[2 * axis] = std::min(bounds_[2 * axis], from[axis]);
                bounds_[2 * axis + 1] = std::max(bounds_[2 * axis + 1], from[axis]);
            }
        }
    }
}

double Arena::distance(double x, double y) const {
    if (is_round()) return round_radius_ - std::hypot(x, y);
    double least = kNothing;
    for (const Wall& wall : walls_) least = std::min(least, wall.distance(x, y));
    return least;
}

double Arena::distance(const Figure& figure, const Pose& pose) const {
    if (figure.is_round) return distance(pose.x, pose.y) - figure.half_x;
    double least = kNothing;
    for (int i = 0; i < 4; ++i) {
        const Point point = corner(figure, pose, i);
        least = std::min(least, distance(point.x, point.y));
    }
    return least;
}

double ray_to_wall(const Wall& wall, double x, double y, double dx, double dy) {
    const double towards = -(wall.normal_x * dx + wall.normal_y * dy);
    return towards > 0 ? std::max(0.0, wall.distance(x, y) / towards) : kNothing;
}

double ray_to_ring(double radius, double x, double y, double dx, double dy) {
    const double along = x * dx + y * dy, off = square(x) + square(y) - square(radius);
    return std::max(0.0, -along + std::sqrt(std::max(0.0, square(along) - off)));
}

double ray_to_figure(double x, double y, double dx, double dy, const Figure& figure, const Pose& pose) {
    return figure.is_round ? ray_to_disc(x, y, dx, dy, pose.x, pose.y, figure.half_x)
                           : ray_to_rectangle(x, y, dx, dy, pose, figure.half_x, figure.half_y);
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

}  // namespace swarmevo

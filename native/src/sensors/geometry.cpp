// SPDX-License-Identifier: BSD-3-Clause
#include "sensors/geometry.hpp"

#include <algorithm>
#include <cmath>

namespace swarmevo {

double ray_to_walls(double x, double y, double dx, double dy, double half_size) {
    const double to_x = dx > 0 ? (half_size - x) / dx : dx < 0 ? (-half_size - x) / dx : kNothing;
    const double to_y = dy > 0 ? (half_size - y) / dy : dy < 0 ? (-half_size - y) / dy : kNothing;
    return std::max(0.0, std::min(to_x, to_y));
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

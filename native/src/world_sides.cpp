// SPDX-License-Identifier: BSD-3-Clause
#include "world_sides.hpp"

#include <algorithm>
#include <cmath>

namespace swarmevo {

Sides::Sides(const Scene& scene, Contacts& contacts, AverageVelocity& average)
    : scene_(scene), contacts_(contacts), average_(average) {
    // Two robots approach each other by at most two thirds of this within a step; the rest is for shoves.
    const double driven = 3 * rim_speed(scene.robot, 1, scene.noise.wheels);
    const double thrown = std::hypot(scene.box.velocity[0], scene.box.velocity[1]) +
                          std::abs(scene.box.velocity[2]) * std::hypot(scene.box.size[0], scene.box.size[1]) / 2;
    reach_ = (driven + thrown) * scene.physics.time_step;
}

// Horizontal normal, friction along the horizontal tangent only. No contact where bodies are not likely to meet.
Sides::Meeting Sides::add(const Solid& first, const Solid& second, double x, double y, double height, double normal_x,
                          double normal_y, double gap, dJointFeedback* feedback) {
    if (gap >= reach_) return Meeting::far;
    const Meeting meeting = average_.note({first.number, second.number, x, y, normal_x, normal_y, gap});
    if (meeting == Meeting::likely)
        dJointSetFeedback(contacts_.add(first.body, second.body, {x, y, height}, {normal_x, normal_y, 0}, gap,
                                        {{-normal_y, normal_x, 0}, scene_.physics.side_friction, 0, 0}),
                          feedback);
    return meeting;
}

Sides::Meeting Sides::add_walls(const Solid& solid, double x, double y, double radius, double height) {
    constexpr Solid wall = {nullptr, AverageVelocity::kWall};
    constexpr double normals[][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
    const double half = scene_.arena.size / 2;
    Meeting nearest = Meeting::far;
    for (const auto& [normal_x, normal_y] : normals) {
        const double to_wall = half + normal_x * x + normal_y * y;
        nearest = std::max(nearest, add(solid, wall, x - normal_x * to_wall, y - normal_y * to_wall, height, normal_x,
                                        normal_y, to_wall - radius));
    }
    return nearest;
}

Sides::Meeting Sides::add_robots(const Solid& first, const Solid& second) {
    const dReal *p = dBodyGetPosition(first.body), *q = dBodyGetPosition(second.body);
    const double dx = p[0] - q[0], dy = p[1] - q[1], limit = 2 * scene_.robot.radius + reach_;
    const double square = dx * dx + dy * dy;
    if (square >= limit * limit || square == 0) return Meeting::far;
    const double distance = std::sqrt(square);
    return add(first, second, (p[0] + q[0]) / 2, (p[1] + q[1]) / 2, scene_.robot.centre_of_mass, dx / distance,
               dy / distance, distance - 2 * scene_.robot.radius);
}

Sides::Meeting Sides::add_push(const Solid& robot, const Box& box, int box_number, Push& push) {
    const dReal *p = dBodyGetPosition(robot.body), *middle = dBodyGetPosition(box.body());
    const Vector x = axis(box.body(), 0), y = axis(box.body(), 1);
    const double dx = p[0] - middle[0], dy = p[1] - middle[1];
    const Separation s = separate_point_from_rectangle(dx * x[0] + dy * x[1], dx * y[0] + dy * y[1],
                                                       scene_.box.size[0] / 2, scene_.box.size[1] / 2);
    push.normal = {s.normal_x * x[0] + s.normal_y * y[0], s.normal_x * x[1] + s.normal_y * y[1], 0};
    push.point = {middle[0] + s.nearest_x * x[0] + s.nearest_y * y[0],
                  middle[1] + s.nearest_x * x[1] + s.nearest_y * y[1], 0};
    const Solid pushed = {box.stands() ? nullptr : box.body(), box_number};
    const Meeting meeting =
        add(robot, pushed, push.point[0], push.point[1], std::min(scene_.box.size[2], scene_.robot.height) / 2,
            push.normal[0], push.normal[1], s.distance - scene_.robot.radius, &push.joint);
    push.may_be = meeting == Meeting::likely;
    return meeting;
}

void Sides::add_box_at_walls(const Box& box, int box_number) {
    const dReal* middle = dBodyGetPosition(box.body());
    const double height = std::min(scene_.box.size[2], scene_.arena.wall_height) / 2;
    for (int i = 0; i < Box::kCorners; ++i) {
        const Vector corner = box.corner(i);
        add_walls({box.body(), box_number}, middle[0] + corner[0], middle[1] + corner[1], 0, height);
    }
}

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
#include "world_sides.hpp"

#include <algorithm>
#include <cmath>

#include "world_constants.hpp"

namespace swarmevo {

Sides::Sides(const Scene& scene, AverageVelocity& average)
    : scene_(scene), average_(average), sprung_(scene.robot.bumper == SWE_BUMPER_SPRUNG) {
    // Two robots approach each other by at most two thirds of this within a step; the rest is for shoves.
    const double driven = 3 * rim_speed(scene.robot, 1, scene.noise.wheels);
    const double thrown = norm(scene.box.velocity[0], scene.box.velocity[1]) +
                          std::abs(scene.box.velocity[2]) * norm(scene.box.size[0], scene.box.size[1]) / 2;
    reach_ = (driven + thrown) * scene.physics.time_step;
    slight_load_ = kRubError * traction_limit(scene) / 2;

    const int robots = static_cast<int>(scene.robots);
    at_walls_ = robots * (robots - 1) / 2;
    at_box_ = at_walls_ + 4 * robots;
    corners_ = at_box_ + robots;
    pairs_.resize(corners_ + 4 * Box::kCorners);  // once: ODE keeps pointers to their feedback
}

void Sides::begin() {
    stored_energy_ = 0;
    meeting_.clear();
    for (Pair& pair : pairs_) pair.may_meet = false;
}

bool Sides::any_rigid() const {
    return std::any_of(meeting_.begin(), meeting_.end(), [](const Pair* pair) { return pair->is_rigid; });
}

// Nothing where bodies are not likely to meet.
bool Sides::add(Pair& pair, const Solid& first, const Solid& second, const Side& side) {
    if (side.gap >= reach_) return false;
    const int bumpers = sprung_ ? first.bumpers + second.bumpers : 0;
    const swe_robot_config& robot = scene_.robot;
    pair.travel = bumpers * robot.bumper_travel;
    AverageVelocity::Touch touch = {
        first.number, second.number, side.x,
        side.y,       side.normal_x, side.normal_y,
        side.gap,     pair.travel,   bumpers > 0 ? robot.bumper_stiffness / bumpers / robot.mass : 0};
    pair.may_meet = average_.note(touch);
    if (!pair.may_meet) return false;
    meeting_.push_back(&pair);
    pair.is_rigid = bumpers == 0;
    pair.may_stop = bumpers == 0 || average_.may_close(touch.gap + pair.travel);
    pair.first = first.body ? first.number : kFixed;
    pair.second = second.body ? second.number : kFixed;
    pair.bodies[0] = first.body;
    pair.bodies[1] = second.body;
    pair.point = {side.x, side.y, side.height};
    pair.normal = {side.normal_x, side.normal_y, 0};
    pair.gap = touch.gap;
    pair.spring = {};
    if (bumpers > 0) pair.spring = {robot.bumper_stiffness / bumpers, robot.bumper_damping / bumpers};
    pair.side_friction = scene_.physics.side_friction;
    const double depth = std::max(0.0, -pair.gap);
    stored_energy_ += pair.spring.stiffness * depth * depth / 2;
    return true;
}

// ---- for ODE ----

// Friction along the horizontal tangent only.
void Sides::add_to(Contacts& contacts) {
    for (Pair* pair : meeting_) {
        pair->bumper = pair->stop = {};
        if (!pair->bodies[0] && !pair->bodies[1]) continue;
        Friction friction = {{-pair->normal[1], pair->normal[0], 0}, pair->side_friction, 0, 0};
        friction.load = pair->load;
        const auto& [first, second] = pair->bodies;
        if (pair->travel > 0) {
            dJointSetFeedback(
                contacts.add_sprung(first, second, pair->point, pair->normal, pair->gap, friction, pair->spring),
                &pair->bumper);
            friction = {friction.direction, 0, 0, 0};  // that of the whole force is the bumper's
        }
        if (pair->may_stop)
            dJointSetFeedback(
                contacts.add(first, second, pair->point, pair->normal, pair->gap + pair->travel, friction),
                &pair->stop);
    }
}

bool Sides::fits() {
    bool all = true;
    for (Pair* pair : meeting_) {
        for (int i = 0; i < 2; ++i) pair->force[i] = pair->bumper.f1[i] + pair->stop.f1[i];
        if (pair->load == Friction::kSolved) continue;
        const double press = pair->press();
        if (std::abs(press - pair->load) * pair->side_friction <= slight_load_) continue;
        pair->load = press;
        all = false;
    }
    return all;
}

void Sides::finish() {
    for (Pair& pair : pairs_) {
        if (!pair.may_meet) pair.force = {};
        pair.load = pair.may_meet ? pair.press() : Friction::kSolved;
        pair.rubbing = pair.force[1] * pair.normal[0] - pair.force[0] * pair.normal[1];
    }
}

bool Sides::add_walls(Pair* pair, const Solid& solid, double x, double y, double radius, double height) {
    constexpr Solid wall = {nullptr, AverageVelocity::kWall, 0};
    constexpr double normals[][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
    const double half = scene_.arena.size / 2;
    bool any = false;
    for (const auto& [normal_x, normal_y] : normals) {
        const double to_wall = half + normal_x * x + normal_y * y;
        any |= add(*pair++, solid, wall,
                   {x - normal_x * to_wall, y - normal_y * to_wall, height, normal_x, normal_y, to_wall - radius});
    }
    return any;
}

bool Sides::add_robot_at_walls(const Solid& robot) {
    const Place& p = average_.place(robot.number);
    return add_walls(&pairs_[at_walls_ + 4 * robot.number], robot, p.x, p.y, scene_.robot.radius,
                     std::min(scene_.arena.wall_height, scene_.robot.height) / 2);
}

bool Sides::add_robots(const Solid& first, const Solid& second) {
    const Place &p = average_.place(first.number), &q = average_.place(second.number);
    const double dx = p.x - q.x, dy = p.y - q.y, limit = 2 * scene_.robot.radius + reach_;
    const double square = dx * dx + dy * dy;
    if (square >= limit * limit || square == 0) return false;
    const double distance = std::sqrt(square);
    return add(pairs_[first.number * (first.number - 1) / 2 + second.number], first, second,
               {(p.x + q.x) / 2, (p.y + q.y) / 2, scene_.robot.centre_of_mass, dx / distance, dy / distance,
                distance - 2 * scene_.robot.radius});
}

bool Sides::add_push(const Solid& robot, const Box& box, int box_number) {
    const Place &p = average_.place(robot.number), &middle = average_.place(box_number);
    const double dx = p.x - middle.x, dy = p.y - middle.y;
    const Separation s =
        separate_point_from_rectangle(dx * middle.cosine + dy * middle.sine, dy * middle.cosine - dx * middle.sine,
                                      scene_.box.size[0] / 2, scene_.box.size[1] / 2);
    const Vector nearest = middle.turned(s.nearest_x, s.nearest_y), normal = middle.turned(s.normal_x, s.normal_y);
    const Solid pushed = {box.stands() ? nullptr : box.body(), box_number, 0};
    return add(pairs_[at_box_ + robot.number], robot, pushed,
               {middle.x + nearest[0], middle.y + nearest[1], std::min(scene_.box.size[2], scene_.robot.height) / 2,
                normal[0], normal[1], s.distance - scene_.robot.radius});
}

void Sides::add_box_at_walls(const Box& box, int box_number) {
    const Place& middle = average_.place(box_number);
    const double height = std::min(scene_.box.size[2], scene_.arena.wall_height) / 2;
    for (int i = 0; i < Box::kCorners; ++i) {
        const Vector& corner = box.corner(i);
        add_walls(&pairs_[corners_ + 4 * i], {box.body(), box_number, 0}, middle.x + corner[0], middle.y + corner[1], 0,
                  height);
    }
}

}  // namespace swarmevo

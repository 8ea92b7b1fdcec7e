// SPDX-License-Identifier: BSD-3-Clause
#include "world/sides.hpp"

#include <algorithm>
#include <cmath>

#include "world/constants.hpp"

namespace swarmevo {

Sides::Sides(const Scene& scene, AverageVelocity& average)
    : scene_(scene), average_(average), sprung_(scene.robot.bumper == SWE_BUMPER_SPRUNG) {
    // Two robots approach each other by at most two thirds of this within a step; the rest is for pushes by others.
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
    meeting_.clear();
    for (Pair& pair : pairs_) pair.may_meet = false;
}

// Nothing where bodies are not likely to meet.
bool Sides::add(Pair& pair, const Solid& first, const Solid& second, const Side& side) {
    if (side.gap >= reach_) return false;
    const int bumpers = sprung_ ? first.bumpers + second.bumpers : 0;
    const swe_robot_config& robot = scene_.robot;
    pair.travel = bumpers * robot.bumper_travel;
    AverageVelocity::Touch touch = {first.number,
                                    second.number,
                                    side.x,
                                    side.y,
                                    side.normal_x,
                                    side.normal_y,
                                    side.gap,
                                    pair.travel,
                                    bumpers > 0 ? robot.bumper_stiffness / bumpers / robot.mass : 0,
                                    0};
    pair.may_meet = average_.note(touch);
    if (!pair.may_meet) return false;
    meeting_.push_back(&pair);
    pair.may_stop = bumpers == 0 || average_.may_close(touch.gap + pair.travel);
    pair.first = first.body ? first.number : kFixed;
    pair.second = second.body ? second.number : kFixed;
    pair.bodies[0] = first.body;
    pair.bodies[1] = second.body;
    pair.point = {side.x, side.y, side.height};
    pair.normal = {side.normal_x, side.normal_y, 0};
    pair.gap = touch.gap;
    pair.closing = touch.closing;
    pair.spring = {};
    if (bumpers > 0) pair.spring = {robot.bumper_stiffness / bumpers, robot.bumper_damping / bumpers};
    pair.side_friction = scene_.physics.side_friction;
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
            dJointSetFeedback(contacts.add_sprung(first, second, pair->point, pair->normal, pair->gap, pair->closing,
                                                  friction, pair->spring),
                              &pair->bumper);
            friction = {friction.direction, 0, 0, 0};  // that of the whole force is the bumper's
        }
        if (pair->may_stop)
            dJointSetFeedback(
                contacts.add(first, second, pair->point, pair->normal, pair->gap + pair->travel, friction),
                &pair->stop);
    }
}

void Sides::read_forces() {
    for (Pair* pair : meeting_)
        for (int i = 0; i < 2; ++i) pair->force[i] = pair->bumper.f1[i] + pair->stop.f1[i];
}

bool Sides::fits() {
    bool all = true;
    for (Pair* pair : meeting_) {
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

Sides::Side Sides::side_of_robots(const Place& first, const Place& second) const {
    const double dx = first.x - second.x, dy = first.y - second.y, distance = norm(dx, dy);
    return {(first.x + second.x) / 2,
            (first.y + second.y) / 2,
            scene_.robot.centre_of_mass,
            dx / distance,
            dy / distance,
            distance - 2 * scene_.robot.radius};
}

Sides::Side Sides::side_of_push(const Place& robot, const Place& box) const {
    const double dx = robot.x - box.x, dy = robot.y - box.y;
    const Separation s = separate_point_from_rectangle(dx * box.cosine + dy * box.sine, dy * box.cosine - dx * box.sine,
                                                       scene_.box.size[0] / 2, scene_.box.size[1] / 2);
    const Vector nearest = box.turned(s.nearest_x, s.nearest_y), normal = box.turned(s.normal_x, s.normal_y);
    const double height = std::min(scene_.box.size[2], scene_.robot.height) / 2;
    return {box.x + nearest[0], box.y + nearest[1], height, normal[0], normal[1], s.distance - scene_.robot.radius};
}

bool Sides::add_robots(const Solid& first, const Solid& second) {
    const Place &p = average_.place(first.number), &q = average_.place(second.number);
    const double dx = p.x - q.x, dy = p.y - q.y, limit = 2 * scene_.robot.radius + reach_;
    const double square = dx * dx + dy * dy;
    if (square >= limit * limit || square == 0) return false;
    return add(pairs_[first.number * (first.number - 1) / 2 + second.number], first, second, side_of_robots(p, q));
}

bool Sides::add_push(const Solid& robot, const Box& box, int box_number) {
    const Solid pushed = {box.stands() ? nullptr : box.body(), box_number, 0};
    return add(pairs_[at_box_ + robot.number], robot, pushed,
               side_of_push(average_.place(robot.number), average_.place(box_number)));
}

double Sides::stored_energy(const std::vector<Place>& robots, const Place& box) const {
    if (!sprung_) return 0;
    const double half = scene_.arena.size / 2, radius = scene_.robot.radius;
    const auto hold = [&](double gap, int bumpers) {
        return gap < 0 ? scene_.robot.bumper_stiffness / bumpers * gap * gap / 2 : 0;
    };
    double sum = 0;
    for (std::size_t i = 0; i < robots.size(); ++i) {
        const Place& p = robots[i];
        for (const double to_wall : {half - p.x, half + p.x, half - p.y, half + p.y}) sum += hold(to_wall - radius, 1);
        sum += hold(side_of_push(p, box).gap, 1);
        for (std::size_t j = 0; j < i; ++j) sum += hold(side_of_robots(p, robots[j]).gap, 2);
    }
    return sum;
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

// SPDX-License-Identifier: BSD-3-Clause
#include "world/sides.hpp"

#include <algorithm>
#include <cmath>

#include "world/constants.hpp"
#include "world/rectangles.hpp"

namespace swarmevo {

Sides::Sides(const Scene& scene, AverageVelocity& average)
    : scene_(scene), average_(average), sprung_(scene.robot.bumper == SWE_BUMPER_SPRUNG) {
    // Two robots approach each other by at most two thirds of this within a step; the rest is for pushes by others.
    const double driven = 3 * rim_speed(scene.robot, 1, scene.noise.wheels);
    double thrown = 0;
    for (const auto& [config, figure] : scene.movables)
        thrown += norm(config.velocity[0], config.velocity[1]) + std::abs(config.velocity[2]) * figure.reach;
    reach_ = (driven + thrown) * scene.physics.time_step;
    slight_load_ = kRubError * traction_limit(scene) / 2;
    for (const Obstacle& obstacle : scene.obstacles)
        obstacles_.push_back(
            {obstacle.pose.x, obstacle.pose.y, std::cos(obstacle.pose.heading), std::sin(obstacle.pose.heading)});

    const std::size_t robots = scene.robots, movables = scene.movables.size(), obstacles = scene.obstacles.size();
    walls_ = scene.arena.is_round() ? 1 : scene.arena.walls().size();
    movables_ = static_cast<int>(movables);
    at_walls_ = robots * (robots - 1) / 2;
    at_movables_ = at_walls_ + walls_ * robots;
    at_obstacles_ = at_movables_ + movables * robots;
    movable_at_walls_ = at_obstacles_ + obstacles * robots;
    movable_at_obstacles_ = movable_at_walls_ + movables * walls_ * Movable::kCorners;
    movable_at_movables_ = movable_at_obstacles_ + movables * obstacles * kMeetings;
    // Once: ODE keeps pointers to their feedback.
    pairs_.resize(movable_at_movables_ + movables * (movables - 1) / 2 * kMeetings);
}

void Sides::begin() {
    for (Pair* pair : meeting_) pair->may_meet = false;
    met_.insert(met_.end(), meeting_.begin(), meeting_.end());
    meeting_.clear();
}

// Nothing where bodies are not likely to meet.
bool Sides::add(Pair& pair, const Solid& first, const Solid& second, const Meeting& meeting) {
    if (meeting.gap >= reach_) return false;
    const int bumpers = sprung_ ? first.bumpers + second.bumpers : 0;
    const swe_robot_config& robot = scene_.robot;
    pair.travel = bumpers * robot.bumper_travel;
    AverageVelocity::Touch touch = {first.number,
                                    second.number,
                                    meeting.x,
                                    meeting.y,
                                    meeting.normal_x,
                                    meeting.normal_y,
                                    meeting.gap,
                                    pair.travel,
                                    bumpers > 0 ? robot.bumper_stiffness / bumpers / robot.mass : 0,
                                    0};
    pair.may_meet = average_.note(touch);
    if (!pair.may_meet) return false;
    meeting_.push_back(&pair);
    pair.may_stop = bumpers == 0 || average_.may_close(touch.gap + pair.travel);
    pair.first = first.body ? first.number : kFixed;
    pair.second = second.body ? second.number : kFixed;
    pair.second_side = second.number;
    pair.bodies[0] = first.body;
    pair.bodies[1] = second.body;
    pair.point = {meeting.x, meeting.y, meeting.height};
    pair.normal = {meeting.normal_x, meeting.normal_y, 0};
    pair.gap = touch.gap;
    pair.closing = touch.closing;
    pair.spring = {};
    if (bumpers > 0) pair.spring = {robot.bumper_stiffness / bumpers, robot.bumper_damping / bumpers};
    pair.side_friction = scene_.physics.side_friction;
    return true;
}

Load Sides::load_on(int number) const {
    const Place& middle = average_.place(number);
    Load load{};
    for (const Pair* pair : meeting_) {
        if (pair->second_side != number) continue;
        const double x = -pair->force[0], y = -pair->force[1];
        load.x += x;
        load.y += y;
        load.torque += (pair->point[0] - middle.x) * y - (pair->point[1] - middle.y) * x;
    }
    return load;
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
    for (Pair* pair : met_)
        if (!pair->may_meet) {
            pair->force = {};
            pair->load = Friction::kSolved;
            pair->rubbing = 0;
        }
    for (Pair* pair : meeting_) {
        pair->load = pair->press();
        pair->rubbing = pair->force[1] * pair->normal[0] - pair->force[0] * pair->normal[1];
    }
    met_.clear();
}

bool Sides::add_walls(Pair* pair, const Solid& solid, double x, double y, double radius, double height) {
    constexpr Solid kWall = {nullptr, AverageVelocity::kWall, 0};
    bool any = false;
    for (const Wall& wall : scene_.arena.walls()) {
        Pair& at_wall = *pair++;
        const double to_wall = wall.distance(x, y);
        if (to_wall - radius >= reach_) continue;
        any |= add(at_wall, solid, kWall,
                   {x - wall.normal_x * to_wall, y - wall.normal_y * to_wall, height, wall.normal_x, wall.normal_y,
                    to_wall - radius});
    }
    const double out = scene_.arena.is_round() ? norm(x, y) : 0;
    if (out > 0) {
        const double round = scene_.arena.round_radius(), ux = x / out, uy = y / out;
        any |= add(*pair, solid, kWall, {round * ux, round * uy, height, -ux, -uy, round - out - radius});
    }
    return any;
}

bool Sides::is_near(const Place& place, double reach, const Figure& figure, const Place& other) const {
    const double dx = place.x - other.x, dy = place.y - other.y, limit = reach + figure.reach + reach_;
    return dx * dx + dy * dy < limit * limit;
}

bool Sides::add_robot_at_walls(const Solid& robot) {
    const Place& p = average_.place(robot.number);
    return add_walls(&pairs_[at_walls_ + walls_ * robot.number], robot, p.x, p.y, scene_.robot.radius,
                     std::min(scene_.arena.wall_height(), scene_.robot.height) / 2);
}

bool Sides::add_robot_at_obstacles(const Solid& robot) {
    const Place& p = average_.place(robot.number);
    bool any = false;
    for (std::size_t i = 0; i < obstacles_.size(); ++i)
        if (is_near(p, scene_.robot.radius, scene_.obstacles[i].figure, obstacles_[i]))
            any |= add(pairs_[at_obstacles_ + obstacles_.size() * robot.number + i], robot,
                       {nullptr, AverageVelocity::kWall, 0}, meeting_of_obstacle(p, i));
    return any;
}

Meeting Sides::meeting_of_robots(const Place& first, const Place& second) const {
    const double dx = first.x - second.x, dy = first.y - second.y, distance = norm(dx, dy);
    return {(first.x + second.x) / 2,
            (first.y + second.y) / 2,
            scene_.robot.centre_of_mass,
            dx / distance,
            dy / distance,
            distance - 2 * scene_.robot.radius};
}

Meeting Sides::meeting_of_disc(double x, double y, double radius, double height, const Figure& figure,
                               const Place& place) {
    const double dx = x - place.x, dy = y - place.y;
    const Separation s = figure.separate(dx * place.cosine + dy * place.sine, dy * place.cosine - dx * place.sine);
    const Vector nearest = place.turned(s.nearest_x, s.nearest_y), normal = place.turned(s.normal_x, s.normal_y);
    return {place.x + nearest[0], place.y + nearest[1], std::min(figure.height, height) / 2, normal[0], normal[1],
            s.distance - radius};
}

Meeting Sides::meeting_of_push(const Place& robot, const Figure& figure, const Place& place) const {
    return meeting_of_disc(robot.x, robot.y, scene_.robot.radius, scene_.robot.height, figure, place);
}

Meeting Sides::meeting_of_obstacle(const Place& robot, std::size_t obstacle) const {
    Meeting meeting = meeting_of_push(robot, scene_.obstacles[obstacle].figure, obstacles_[obstacle]);
    meeting.height = std::min(meeting.height, scene_.robot.centre_of_mass);  // of a tall one, as robots meet each other
    return meeting;
}

bool Sides::add_robots(const Solid& first, const Solid& second) {
    const Place &p = average_.place(first.number), &q = average_.place(second.number);
    const double dx = p.x - q.x, dy = p.y - q.y, limit = 2 * scene_.robot.radius + reach_;
    const double square = dx * dx + dy * dy;
    if (square >= limit * limit || square == 0) return false;
    return add(pairs_[first.number * (first.number - 1) / 2 + second.number], first, second, meeting_of_robots(p, q));
}

bool Sides::add_push(const Solid& robot, const Movable& movable, int number) {
    const Place &p = average_.place(robot.number), &place = average_.place(movable.number());
    return is_near(p, scene_.robot.radius, movable.figure(), place) &&
           add(pairs_[at_movables_ + movables_ * robot.number + number], robot, solid_of(movable),
               meeting_of_push(p, movable.figure(), place));
}

double Sides::stored_energy(const std::vector<Place>& robots, const std::vector<Place>& movables) const {
    if (!sprung_) return 0;
    const double radius = scene_.robot.radius;
    const auto hold = [&](double gap, int bumpers) {
        return gap < 0 ? scene_.robot.bumper_stiffness / bumpers * gap * gap / 2 : 0;
    };
    double sum = 0;
    for (std::size_t i = 0; i < robots.size(); ++i) {
        const Place& p = robots[i];
        if (scene_.arena.is_round()) sum += hold(scene_.arena.round_radius() - norm(p.x, p.y) - radius, 1);
        for (const Wall& wall : scene_.arena.walls()) sum += hold(wall.distance(p.x, p.y) - radius, 1);
        for (std::size_t j = 0; j < movables.size(); ++j)
            sum += hold(meeting_of_push(p, scene_.movables[j].figure, movables[j]).gap, 1);
        for (std::size_t j = 0; j < obstacles_.size(); ++j) sum += hold(meeting_of_obstacle(p, j).gap, 1);
        for (std::size_t j = 0; j < i; ++j) sum += hold(meeting_of_robots(p, robots[j]).gap, 2);
    }
    return sum;
}

// ---- movables ----

void Sides::add_movable_at_walls(const Movable& movable, int number) {
    const Place& middle = average_.place(movable.number());
    const Figure& figure = movable.figure();
    const double height = std::min(figure.height, scene_.arena.wall_height()) / 2;
    Pair* pair = &pairs_[movable_at_walls_ + number * walls_ * Movable::kCorners];
    const Solid solid = {movable.body(), movable.number(), 0};
    if (figure.is_round) {
        add_walls(pair, solid, middle.x, middle.y, figure.half_x, height);
        return;
    }
    for (int i = 0; i < Movable::kCorners; ++i) {
        const Vector& corner = movable.corner(i);
        add_walls(pair + walls_ * i, solid, middle.x + corner[0], middle.y + corner[1], 0, height);
    }
}

void Sides::add_movable_at_obstacles(const Movable& movable, int number) {
    const Solid solid = {movable.body(), movable.number(), 0};
    for (std::size_t i = 0; i < obstacles_.size(); ++i)
        add_figures(&pairs_[movable_at_obstacles_ + (number * obstacles_.size() + i) * kMeetings], movable, solid,
                    {nullptr, AverageVelocity::kWall, 0}, scene_.obstacles[i].figure, obstacles_[i]);
}

// One of which does not stand.
void Sides::add_movables(const Movable& first, int first_number, const Movable& second, int second_number) {
    const std::size_t slot = first_number * (first_number - 1) / 2 + second_number;
    Pair* pair = &pairs_[movable_at_movables_ + slot * kMeetings];
    // Pairs begin with a body that moves or may be moved.
    if (first.stands())
        add_figures(pair, second, solid_of(second), solid_of(first), first.figure(), average_.place(first.number()));
    else
        add_figures(pair, first, solid_of(first), solid_of(second), second.figure(), average_.place(second.number()));
}

void Sides::add_figures(Pair* pair, const Movable& movable, const Solid& solid, const Solid& other,
                        const Figure& figure, const Place& place) {
    const Figure& own = movable.figure();
    const Place& middle = average_.place(movable.number());
    if (!is_near(middle, own.reach, figure, place)) return;
    if (own.is_round) {
        add(*pair, solid, other, meeting_of_disc(middle.x, middle.y, own.half_x, own.height, figure, place));
        return;
    }
    if (figure.is_round) {
        Meeting meeting = meeting_of_disc(place.x, place.y, figure.half_x, figure.height, own, middle);
        meeting.normal_x = -meeting.normal_x;
        meeting.normal_y = -meeting.normal_y;
        add(*pair, solid, other, meeting);
        return;
    }
    for (const Meeting& meeting : meetings_of_rectangles(own, middle, figure, place))
        add(*pair++, solid, other, meeting);
}

Sides::Solid Sides::solid_of(const Movable& movable) {
    return {movable.stands() ? nullptr : movable.body(), movable.number(), 0};
}

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
#include "shapes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace swarmevo_reference {

namespace {

constexpr double kAtRim =
    1e-9;  // m, beyond a side within which a corner counts as inside: boxes that stand flush touch

// A pose with its sine and cosine.
struct Frame {
    double x, y, c, s;

    explicit Frame(const Pose& pose) : x(pose.x), y(pose.y), c(std::cos(pose.heading)), s(std::sin(pose.heading)) {}

    Point inside(const Point& p) const { return turned_back({p.x - x, p.y - y}); }
    Point outside(const Point& p) const { return {x + c * p.x - s * p.y, y + s * p.x + c * p.y}; }
    Point turned(const Point& p) const { return {c * p.x - s * p.y, s * p.x + c * p.y}; }
    Point turned_back(const Point& p) const { return {c * p.x + s * p.y, -s * p.x + c * p.y}; }
};

std::array<Point, 4> corners(const Figure& figure, const Frame& frame) {
    const double a = figure.length / 2, b = figure.width / 2;
    return {frame.outside({-a, -b}), frame.outside({a, -b}), frame.outside({-a, b}), frame.outside({a, b})};
}

double dot(const Point& one, const Point& other) {
    return one.x * other.x + one.y * other.y;
}

void disc_in_disc(double radius, const Pose& at, double other_radius, const Pose& other, Contacts& found) {
    const double dx = at.x - other.x, dy = at.y - other.y, squared = dx * dx + dy * dy, reach = radius + other_radius;
    if (squared >= reach * reach || squared == 0) return;  // two in one place have no direction to part in
    const double distance = std::sqrt(squared), nx = dx / distance, ny = dy / distance;
    found.add({other.x + other_radius * nx, other.y + other_radius * ny, nx, ny, reach - distance});
}

void disc_in_rectangle(double radius, const Pose& at, const Figure& figure, const Pose& other, Contacts& found) {
    const Frame frame(other);
    const Point middle = frame.inside({at.x, at.y});
    const double half_length = figure.length / 2, half_width = figure.width / 2;
    Point nearest{std::clamp(middle.x, -half_length, half_length), std::clamp(middle.y, -half_width, half_width)};
    Point n{middle.x - nearest.x, middle.y - nearest.y};
    double gap = std::sqrt(dot(n, n));
    if (gap > 0) {
        n = {n.x / gap, n.y / gap};
    } else {  // the disc's middle is inside: out by the nearest side
        const double to_end = half_length - std::abs(middle.x), to_side = half_width - std::abs(middle.y);
        gap = -std::min(to_end, to_side);
        n = to_end < to_side ? Point{std::copysign(1, middle.x), 0} : Point{0, std::copysign(1, middle.y)};
        nearest = {nearest.x - gap * n.x, nearest.y - gap * n.y};
    }
    if (gap >= radius) return;
    const Point point = frame.outside(nearest), normal = frame.turned(n);
    found.add({point.x, point.y, normal.x, normal.y, radius - gap});
}

// From a point in a rectangle along a direction to its rim.
double way_out(const Point& from, const Point& direction, const Figure& figure, const Frame& frame) {
    const Point at = frame.inside(from), d = frame.turned_back(direction);
    const auto to = [](double place, double speed, double half) {
        return speed == 0 ? std::numeric_limits<double>::infinity() : (std::copysign(half, speed) - place) / speed;
    };
    return std::min(to(at.x, d.x, figure.length / 2), to(at.y, d.y, figure.width / 2));
}

bool contains(const Figure& figure, const Frame& frame, const Point& point) {
    const Point at = frame.inside(point);
    return std::abs(at.x) <= figure.length / 2 + kAtRim && std::abs(at.y) <= figure.width / 2 + kAtRim;
}

void rectangle_in_rectangle(const Figure& one, const Pose& at, const Figure& other, const Pose& other_at,
                            Contacts& found) {
    const Frame frame(at), other_frame(other_at);
    const auto mine = corners(one, frame), theirs = corners(other, other_frame);
    Point normal;
    double least = std::numeric_limits<double>::infinity();
    for (const Point& axis :
         {frame.turned({1, 0}), frame.turned({0, 1}), other_frame.turned({1, 0}), other_frame.turned({0, 1})})
        for (const Point& out : {axis, Point{-axis.x, -axis.y}}) {
            double behind = std::numeric_limits<double>::infinity(), front = -behind;
            for (const Point& corner : mine) behind = std::min(behind, dot(corner, out));
            for (const Point& corner : theirs) front = std::max(front, dot(corner, out));
            if (front <= behind) return;
            if (front - behind < least) {
                least = front - behind;
                normal = out;
            }
        }
    const auto add = [&](const Point& corner, double depth) {
        if (depth > 0) found.add({corner.x, corner.y, normal.x, normal.y, depth});
    };
    for (const Point& corner : mine)
        if (contains(other, other_frame, corner)) add(corner, way_out(corner, normal, other, other_frame));
    for (const Point& corner : theirs)
        if (contains(one, frame, corner)) add(corner, way_out(corner, {-normal.x, -normal.y}, one, frame));
}

void disc_beyond_walls(double radius, const Pose& at, const Arena& arena, Contacts& found) {
    if (arena.radius > 0) {
        const double distance = std::sqrt(at.x * at.x + at.y * at.y);
        if (distance + radius <= arena.radius) return;
        const double x = at.x / distance, y = at.y / distance;
        found.add({x * arena.radius, y * arena.radius, -x, -y, distance + radius - arena.radius});
        return;
    }
    for (const auto& [from, inwards] : arena.walls) {
        const double away = (at.x - from.x) * inwards.x + (at.y - from.y) * inwards.y;
        if (away < radius)
            found.add({at.x - away * inwards.x, at.y - away * inwards.y, inwards.x, inwards.y, radius - away});
    }
}

}  // namespace

double Figure::reach() const {
    return is_round ? length / 2 : std::sqrt(length * length + width * width) / 2;
}

Arena Arena::round(double radius) {
    if (!(radius > 0)) throw std::invalid_argument("arena: expected a radius above 0, got " + std::to_string(radius));
    return {radius, {}};
}

// The inside is to the left of each wall.
Arena Arena::polygon(const std::vector<Point>& corners) {
    if (corners.size() < 3) throw std::invalid_argument("arena: expected at least three corners");
    Arena arena;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const Point &from = corners[i], &to = corners[(i + 1) % corners.size()];
        const double length = std::hypot(to.x - from.x, to.y - from.y);
        if (!(length > 0)) throw std::invalid_argument("arena: expected corners apart from each other");
        arena.walls.push_back({from, {-(to.y - from.y) / length, (to.x - from.x) / length}});
    }
    return arena;
}

Arena Arena::square(double side) {
    const double end = side / 2;
    return polygon({{-end, -end}, {end, -end}, {end, end}, {-end, end}});
}

Contacts overlap(const Figure& one, const Pose& at, const Figure& other, const Pose& other_at) {
    Contacts found;
    const double dx = at.x - other_at.x, dy = at.y - other_at.y, reach = one.reach() + other.reach();
    if (dx * dx + dy * dy > reach * reach) return found;
    if (one.is_round && other.is_round) {
        disc_in_disc(one.length / 2, at, other.length / 2, other_at, found);
    } else if (one.is_round) {
        disc_in_rectangle(one.length / 2, at, other, other_at, found);
    } else if (other.is_round) {
        Contacts seen_from_disc;
        disc_in_rectangle(other.length / 2, other_at, one, at, seen_from_disc);
        for (const Contact& c : seen_from_disc) found.add({c.x, c.y, -c.nx, -c.ny, c.depth});
    } else {
        rectangle_in_rectangle(one, at, other, other_at, found);
    }
    return found;
}

Contacts beyond_walls(const Figure& figure, const Pose& at, const Arena& arena) {
    Contacts found;
    if (figure.is_round) {
        disc_beyond_walls(figure.length / 2, at, arena, found);
        return found;
    }
    for (const Point& corner : corners(figure, Frame(at))) disc_beyond_walls(0, {corner.x, corner.y, 0}, arena, found);
    return found;
}

}  // namespace swarmevo_reference

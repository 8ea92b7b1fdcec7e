// SPDX-License-Identifier: BSD-3-Clause
// Distances and rays of figures against points sampled densely.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "fixture.hpp"
#include "rng.hpp"
#include "scene/figure.hpp"
#include "scene/scene.hpp"

namespace swarmevo {
namespace {

constexpr unsigned kRandom = 300;

struct Placed {
    Figure figure;
    Pose pose;
};

Placed random_figure(unsigned number, unsigned which) {
    const auto w = draw({71, 0, number, 0}, Purpose::start, which, 0),
               v = draw({72, 0, number, 0}, Purpose::start, which, 0);
    const bool round = w[0] % 2 == 0;
    const double x = 0.05 + 0.2 * uniform(w[1]), y = round ? x : 0.05 + 0.2 * uniform(w[2]);
    return {Figure::of(round ? SWE_SHAPE_CYLINDER : SWE_SHAPE_BOX, x, y, 0.1),
            {0.2 * symmetric(v[0]), 0.2 * symmetric(v[1]), kPi * symmetric(v[2])}};
}

// Is a point of the floor in it? From the definition, without its distance.
bool contains(const Placed& p, double x, double y) {
    const double dx = x - p.pose.x, dy = y - p.pose.y, c = std::cos(p.pose.heading), s = std::sin(p.pose.heading);
    if (p.figure.is_round) return std::hypot(dx, dy) < p.figure.half_x;
    return std::abs(c * dx + s * dy) < p.figure.half_x && std::abs(c * dy - s * dx) < p.figure.half_y;
}

struct Point {
    double x, y;
};
std::vector<Point> outline(const Placed& p, int n = 800) {
    std::vector<Point> points;
    const double c = std::cos(p.pose.heading), s = std::sin(p.pose.heading);
    for (int i = 0; i < n; ++i) {
        const double along = 4.0 * i / n, side = std::floor(along), at = 2 * (along - side) - 1;
        double x = side == 0 ? at : side == 1 ? 1 : side == 2 ? -at : -1;
        double y = side == 0 ? -1 : side == 1 ? at : side == 2 ? 1 : -at;
        x *= p.figure.half_x;
        y *= p.figure.half_y;
        if (p.figure.is_round) {
            x = p.figure.half_x * std::cos(2 * kPi * i / n);
            y = p.figure.half_x * std::sin(2 * kPi * i / n);
        }
        points.push_back({p.pose.x + c * x - s * y, p.pose.y + s * x + c * y});
    }
    return points;
}

swe_arena_config hexagon() {
    swe_arena_config config{};
    config.shape = SWE_ARENA_SHAPE_POLYGON;
    config.n_corners = 6;
    for (int i = 0; i < 6; ++i) {
        config.corners[i][0] = 0.5 * std::cos(i * kPi / 3);
        config.corners[i][1] = 0.5 * std::sin(i * kPi / 3);
    }
    return config;
}

}  // namespace

TEST_CASE("two figures are as far apart as their outlines, and overlap where one has points of the other") {
    unsigned apart = 0, overlapping = 0;
    for (unsigned number = 0; number < kRandom; ++number) {
        const Placed a = random_figure(number, 0), b = random_figure(number, 1);
        const auto points = outline(a), others = outline(b);
        double nearest = std::numeric_limits<double>::infinity();
        bool overlap = contains(a, b.pose.x, b.pose.y) || contains(b, a.pose.x, a.pose.y);
        for (const Point& p : points) {
            overlap |= contains(b, p.x, p.y);
            for (const Point& q : others) nearest = std::min(nearest, std::hypot(p.x - q.x, p.y - q.y));
        }
        const double found = distance(a.figure, a.pose, b.figure, b.pose);
        CHECK(found == doctest::Approx(distance(b.figure, b.pose, a.figure, a.pose)).epsilon(1e-12).scale(1));
        if (std::abs(found) < 1e-3) continue;
        (overlap ? overlapping : apart)++;
        CHECK((found < 0) == overlap);
        if (!overlap) CHECK(found == doctest::Approx(nearest).scale(1).epsilon(1e-3));
    }
    CHECK(apart > kRandom / 5);
    CHECK(overlapping > kRandom / 5);
}

TEST_CASE("rays end where they enter a figure, and at the walls of any arena") {
    swe_arena_config circle{};
    circle.shape = SWE_ARENA_SHAPE_CIRCLE;
    circle.size[0] = circle.size[1] = 1;
    const Arena round(circle), six(hexagon());
    for (unsigned number = 0; number < kRandom; ++number) {
        const Placed figure = random_figure(number, 0);
        const auto w = draw({73, 0, number, 0}, Purpose::start, 0, 0);
        const double x = 0.3 * symmetric(w[0]), y = 0.3 * symmetric(w[1]), angle = kPi * symmetric(w[2]);
        const double dx = std::cos(angle), dy = std::sin(angle);
        const double hit = ray_to_figure(x, y, dx, dy, figure.figure, figure.pose);
        double marched = std::numeric_limits<double>::infinity();
        for (double t = 0; t < 1; t += 2e-4)
            if (contains(figure, x + t * dx, y + t * dy)) {
                marched = t;
                break;
            }
        if (std::isinf(hit)) {
            CHECK(std::isinf(marched));
        } else if (hit < 0.999) {
            // A chord shorter than a step may be missed.
            if (std::isfinite(marched)) CHECK(marched == doctest::Approx(hit).scale(1).epsilon(3e-4));
        }
        const double wall = ray_to_arena(round, x, y, dx, dy), edge = ray_to_arena(six, x, y, dx, dy);
        CHECK(std::hypot(x + wall * dx, y + wall * dy) == doctest::Approx(0.5).epsilon(1e-9));
        CHECK(six.distance(x + edge * dx, y + edge * dy) == doctest::Approx(0).scale(1).epsilon(1e-9));
    }
}

TEST_CASE("an arena knows how far its walls are, outside too") {
    const Arena six(hexagon());
    CHECK(six.distance(0, 0) == doctest::Approx(0.5 * std::cos(kPi / 6)));
    CHECK(six.distance(0.6, 0) < 0);
    CHECK(six.bounds()[1] == doctest::Approx(0.5));
    CHECK(six.bounds()[3] == doctest::Approx(0.5 * std::sin(kPi / 3)));
    const Figure box = Figure::of(SWE_SHAPE_BOX, 0.2, 0.1, 0.1), puck = Figure::of(SWE_SHAPE_CYLINDER, 0.2, 0.2, 0.1);
    CHECK(six.distance(puck, {0, 0.2, 0}) == doctest::Approx(0.5 * std::cos(kPi / 6) - 0.3));
    CHECK(six.distance(box, {0, 0.2, kPi / 2}) == doctest::Approx(0.5 * std::cos(kPi / 6) - 0.3));
}

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
// What surrounds robots in the reference, against closed formulas: cylinders, obstacles, walls, movables that meet.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "../../native/reference/planar.hpp"

using namespace swarmevo_reference;

namespace {

constexpr double kHalfPi = 1.57079632679489661923;

double traction(const Parameters& p) {
    return p.mu_wheel * p.robot_mass * kGravity / (1 + p.mu_wheel * p.mass_height / p.caster_offset);
}

void run(Planar& world, double seconds) {
    world.advance(std::lround(seconds / Parameters{}.time_step));
}

void drive(Planar& world) {
    for (std::size_t i = 0; i < world.robots(); ++i) world.set_command(i, 1, 1);
}

Movable cylinder(double diameter, double mass, Body start, double friction = 0.62, double feet = 1) {
    return {{true, diameter, diameter}, mass, friction, feet, 0.015, start};
}

Movable box(double length, double width, double mass, Body start, double friction = 0.62) {
    return {{false, length, width}, mass, friction, 1, 0.015, start};
}

Surroundings open(std::vector<Movable> movables) {
    return {std::move(movables), {}, Arena::square(10)};
}

}  // namespace

TEST_CASE("reference: a cylinder that slides stops after v^2 / (2 mu g), one that spins after w^2 / (2 alpha)") {
    const Parameters p;
    for (const double feet : {1.0, 0.4}) {
        Planar sliding(p, {}, open({cylinder(0.1, 0.1, {0, 0, 0.3, 0.3, 0, 0}, 0.62, feet)}));
        run(sliding, 0.2);
        CHECK(sliding.movable(0).x == doctest::Approx(0.3 * 0.3 / (2 * 0.62 * kGravity)).epsilon(2e-3));

        Planar spinning(p, {}, open({cylinder(0.1, 0.1, {0, 0, 0, 0, 0, 5}, 0.62, feet)}));
        run(spinning, 0.3);
        const double alpha = 0.62 * kGravity * feet * 0.05 / (0.05 * 0.05 / 2);
        CHECK(spinning.movable(0).heading == doctest::Approx(25 / (2 * alpha)).epsilon(3e-3));
    }
}

TEST_CASE("reference: robots push a row of movables if their traction exceeds the friction of all") {
    const Parameters p;
    constexpr double friction = 0.62;
    for (const bool is_round : {false, true})
        for (const double share : {0.98, 1.02}) {
            const double mass = traction(p) / share / (friction * kGravity) / 3;
            std::vector<Movable> row;
            for (int i = 0; i < 3; ++i) {
                const Body at{0, 0.08 * i, 0, 0, 0, 0};
                row.push_back(is_round ? cylinder(0.08, mass, at) : box(0.08, 0.08, mass, at));
            }
            const double pressed = traction(p) / p.bumper_stiffness;
            Planar world(p, {{0, -0.04 - p.robot_radius + pressed, kHalfPi, 0, 0, 0}}, open(row));
            drive(world);
            run(world, 0.5);
            const double before = world.movable(2).vy;
            run(world, 0.5);
            const double expected = std::max(0.0, traction(p) * (1 - 1 / share) / (3 * mass + p.robot_mass));
            CAPTURE(is_round);
            CAPTURE(share);
            CHECK((world.movable(2).vy - before) / 0.5 == doctest::Approx(expected).epsilon(5e-3));
            CHECK(world.movable(2).y - 0.16 < (share < 1 ? 1e-4 : 1));
        }
}

// Springs and dampers that do not pull give back more than a damped vibration does, most where boxes touch at all
// corners.
TEST_CASE("reference: what collides without friction keeps its momentum and does not part") {
    Parameters p;
    p.mu_side = 0;
    for (const bool is_round : {false, true}) {
        const Body one{-0.05, 0, 0, 0.4, 0, 0}, other{0.05, 0, 0, 0, 0, 0};
        Planar world(
            p, {},
            open(is_round ? std::vector<Movable>{cylinder(0.08, 0.1, one, 0), cylinder(0.08, 0.3, other, 0)}
                          : std::vector<Movable>{box(0.08, 0.06, 0.1, one, 0), box(0.08, 0.06, 0.3, other, 0)}));
        run(world, 0.3);
        const double a = world.movable(0).vx, b = world.movable(1).vx;
        CHECK(0.1 * a + 0.3 * b == doctest::Approx(0.04).epsilon(1e-9));
        CHECK(b - a >= -1e-9);
        CHECK(b - a <= 0.02 * 0.4);
        CHECK(std::abs(world.movable(1).heading) < 1e-9);
    }
}

TEST_CASE("reference: a disc that hits another off its middle gives it half of what it has along their line") {
    Parameters p;
    p.mu_side = 0;
    const double off = 0.03;
    Planar world(p, {}, open({cylinder(0.08, 0.1, {-0.1, off, 0, 0.4, 0, 0}, 0), cylinder(0.08, 0.1, {}, 0)}));
    run(world, 0.3);
    const double sine = off / 0.08, cosine = std::sqrt(1 - sine * sine);
    CHECK(world.movable(1).vx == doctest::Approx(0.4 * cosine * cosine / 2).epsilon(0.02));
    CHECK(world.movable(1).vy == doctest::Approx(-0.4 * cosine * sine / 2).epsilon(0.02));
}

TEST_CASE("reference: a robot presses its bumper in at any wall and obstacle by traction over stiffness") {
    const Parameters p;
    const double compression = traction(p) / p.bumper_stiffness, s = std::sqrt(0.5);
    const auto beyond = [&](const Surroundings& surroundings, double heading) {
        Planar world(p, {{0, 0, heading, 0, 0, 0}}, surroundings);
        drive(world);
        run(world, 4);
        const Body& b = world.robot(0);
        CHECK(std::abs(std::cos(heading) * b.y - std::sin(heading) * b.x) < 1e-6);
        return std::hypot(b.x, b.y) + p.robot_radius;
    };
    const Arena diamond = Arena::polygon({{0.4 / s, 0}, {0, 0.4 / s}, {-0.4 / s, 0}, {0, -0.4 / s}});
    CHECK(beyond({{}, {}, Arena::round(0.4)}, 1.0) - 0.4 == doctest::Approx(compression).epsilon(1e-3));
    CHECK(beyond({{}, {}, diamond}, kHalfPi / 2) - 0.4 == doctest::Approx(compression).epsilon(1e-3));
    const Obstacle block{{false, 0.1, 0.2}, {0.25 * s, 0.25 * s, kHalfPi / 2}};
    CHECK(beyond({{}, {block}, Arena::square(2)}, kHalfPi / 2) - 0.2 == doctest::Approx(compression).epsilon(1e-3));
    const Obstacle post{{true, 0.1, 0.1}, {0.25, 0, 0}};
    CHECK(beyond({{}, {post}, Arena::square(2)}, 0) - 0.2 == doctest::Approx(compression).epsilon(1e-3));
}

TEST_CASE("reference: what is pushed stops at walls and obstacles, by the traction over the rigid stiffness") {
    const Parameters p;
    const double give = traction(p) / p.contact_stiffness;
    const auto end = [&](const Movable& movable, const Surroundings& around) {
        Surroundings all = around;
        all.movables = {movable};
        Planar world(p, {{-0.2, 0, 0, 0, 0, 0}}, all);
        drive(world);
        run(world, 4);
        return world.movable(0).x;
    };
    const Obstacle block{{false, 0.1, 0.3}, {0.25, 0, 0}}, post{{true, 0.1, 0.1}, {0.25, 0, 0}};
    const Movable round = cylinder(0.08, 0.03, {}), square = box(0.08, 0.08, 0.03, {});
    const Surroundings at_block{{}, {block}, Arena::square(2)}, at_post{{}, {post}, Arena::square(2)};
    CHECK(std::abs(end(round, at_block) - 0.16) < 2 * give);
    CHECK(std::abs(end(square, at_block) - 0.16) < 2 * give);
    CHECK(std::abs(end(round, at_post) - 0.16) < 2 * give);
    CHECK(std::abs(end(square, at_post) - 0.16) < 2 * give);
    CHECK(std::abs(end(round, {{}, {}, Arena::round(0.3)}) - 0.26) < 2 * give);
    // Both corners of the box's face at the round wall.
    CHECK(std::abs(end(square, {{}, {}, Arena::round(0.3)}) - (std::sqrt(0.09 - 0.0016) - 0.04)) < 2 * give);
}

TEST_CASE("reference: the turned world of cylinders, boxes and obstacles does the turned thing") {
    const Parameters p;
    const auto melee = [&](double turn) {
        const double c = std::cos(turn), s = std::sin(turn);
        const auto body = [&](double x, double y, double heading) {
            return Body{c * x - s * y, s * x + c * y, heading + turn, 0, 0, 0};
        };
        const auto point = [&](double x, double y) { return Point{c * x - s * y, s * x + c * y}; };
        const Body post = body(0.02, 0.33, 0), block = body(0.3, 0.0, 0.5);
        Planar world(p, {body(-0.03, -0.3, kHalfPi), body(0.05, -0.3, kHalfPi), body(0.1, 0, 0.2)},
                     {{cylinder(0.1, 0.04, body(0, -0.18, 0)), box(0.1, 0.06, 0.03, body(0.02, -0.08, 0.2)),
                       cylinder(0.06, 0.02, body(-0.03, 0.02, 0))},
                      {{{true, 0.1, 0.1}, {post.x, post.y, 0}}, {{false, 0.1, 0.2}, {block.x, block.y, block.heading}}},
                      Arena::polygon({point(-0.5, -0.5), point(0.5, -0.4), point(0.5, 0.4), point(-0.5, 0.5)})});
        drive(world);
        run(world, 2);
        CHECK(world.movable(2).vy != 0);
        std::vector<Body> back;
        for (std::size_t i = 0; i < 6; ++i) {
            const Body& b = i < 3 ? world.robot(i) : world.movable(i - 3);
            back.push_back({c * b.x + s * b.y, -s * b.x + c * b.y, b.heading - turn, 0, 0, 0});
        }
        return back;
    };
    const auto plain = melee(0), turned = melee(0.7);
    for (std::size_t i = 0; i < plain.size(); ++i) {
        CHECK(std::abs(plain[i].x - turned[i].x) < 1e-8);
        CHECK(std::abs(plain[i].y - turned[i].y) < 1e-8);
        CHECK(std::abs(plain[i].heading - turned[i].heading) < 1e-6);
    }
    CHECK(std::hypot(plain[5].x + 0.03, plain[5].y - 0.02) > 0.03);  // all of the row has been pushed
}

TEST_CASE("reference: surroundings that cannot be are an error") {
    const Parameters p;
    CHECK_THROWS_AS(Planar(p, {}, open({cylinder(0.1, 0, {})})), std::invalid_argument);
    CHECK_THROWS_AS(Planar(p, {}, open({{{true, 0.1, 0.2}, 1, 1, 1, 0, {}}})), std::invalid_argument);
    CHECK_THROWS_AS(Arena::round(0), std::invalid_argument);
    CHECK_THROWS_AS(Arena::polygon({{0, 0}, {1, 0}}), std::invalid_argument);
}

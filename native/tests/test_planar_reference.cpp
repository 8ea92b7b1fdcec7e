// SPDX-License-Identifier: BSD-3-Clause
// The reference against closed formulas: what it is held against must not be a simulator again.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <stdexcept>
#include <vector>

#include "../../native/reference/planar.hpp"

using namespace swarmevo_reference;

namespace {

constexpr double kHalfPi = 1.57079632679489661923;

double top_speed(const Parameters& p) {
    return p.wheel_top_speed * p.wheel_radius;
}

// Deceleration of a robot whose wheels slip forwards: friction F = mu (m g - F h / a).
double grip(const Parameters& p) {
    return p.mu_wheel * kGravity / (1 + p.mu_wheel * p.mass_height / p.caster_offset);
}

double traction(const Parameters& p) {
    return p.robot_mass * grip(p);
}

void run(Planar& world, double seconds) {
    world.advance(std::lround(seconds / Parameters{}.time_step));
}

void drive(Planar& world) {
    for (std::size_t i = 0; i < world.robots(); ++i) world.set_command(i, 1, 1);
}

// Robots side by side, `gap` before a box that stands in the origin, and headed for its long face.
std::vector<Body> row(const Parameters& p, int n, double gap) {
    constexpr double spacing = 0.08;
    std::vector<Body> robots;
    for (int i = 0; i < n; ++i)
        robots.push_back({(i - (n - 1) / 2.0) * spacing, -p.box_width / 2 - p.robot_radius - gap, kHalfPi, 0, 0, 0});
    return robots;
}

// Way of a box in a throw: the equations of motion of a rigid body on four feet, by the midpoint rule.
struct Thrown {
    double way, turn;
};

Thrown throw_box(const Parameters& p, double vx, double spin) {
    constexpr double dt = 1e-5, still = 1e-4;
    const double gyration2 = (p.box_length * p.box_length + p.box_width * p.box_width) / 12;
    struct Rates {
        double ax, ay, alpha;
    };
    const auto rates = [&](double heading, double u, double v, double w) {
        Rates sum{0, 0, 0};
        for (const double a : {-p.box_length / 2, p.box_length / 2})
            for (const double b : {-p.box_width / 2, p.box_width / 2}) {
                const double rx = a * std::cos(heading) - b * std::sin(heading);
                const double ry = a * std::sin(heading) + b * std::cos(heading);
                const double fx = u - w * ry, fy = v + w * rx, size = std::max(std::hypot(fx, fy), 1e-9);
                sum.ax -= p.mu_box * kGravity / 4 * fx / size;
                sum.ay -= p.mu_box * kGravity / 4 * fy / size;
                sum.alpha -= p.mu_box * kGravity / 4 * (rx * fy - ry * fx) / size / gyration2;
            }
        return sum;
    };
    double x = 0, y = 0, heading = 0, u = vx, v = 0, w = spin;
    while (std::hypot(u, v) + std::abs(w) * std::sqrt(gyration2) > still) {
        const Rates first = rates(heading, u, v, w);
        const double um = u + first.ax * dt / 2, vm = v + first.ay * dt / 2, wm = w + first.alpha * dt / 2;
        const Rates middle = rates(heading + w * dt / 2, um, vm, wm);
        x += um * dt;
        y += vm * dt;
        heading += wm * dt;
        u += middle.ax * dt;
        v += middle.ay * dt;
        w += middle.alpha * dt;
    }
    return {std::hypot(x, y), heading};
}

// Four robots that drive into each other, into the box and into walls, as seen through a map of the plane.
template <typename Map>
std::vector<Body> melee(bool sprung, Map map, bool swap_wheels) {
    Parameters p;
    p.sprung = sprung;
    p.mu_box = 0.3;
    const std::vector<Body> robots = {{-0.05, -0.14, 1.4, 0, 0, 0},
                                      {0.04, -0.15, 1.7, 0, 0, 0},
                                      {0.25, 0.02, 3.0, 0, 0, 0},
                                      {-0.3, -0.43, -1.1, 0, 0, 0}};
    const double commands[4][2] = {{1, 0.9}, {0.8, 1}, {1, 0.95}, {0.9, 0.7}};
    std::vector<Body> mapped;
    for (const Body& robot : robots) mapped.push_back(map(robot));
    Planar world(p, mapped, map(Body{0.01, 0, 0.1, 0, 0, 0}));
    for (std::size_t i = 0; i < robots.size(); ++i)
        world.set_command(i, commands[i][swap_wheels ? 1 : 0], commands[i][swap_wheels ? 0 : 1]);
    run(world, 0.8);
    std::vector<Body> end;
    for (std::size_t i = 0; i < robots.size(); ++i) end.push_back(world.robot(i));
    end.push_back(world.box());
    CHECK(world.largest_push() > 0);
    return end;
}

void check_same(const Body& one, const Body& other) {
    constexpr double tolerance = 1e-9;
    CHECK(std::abs(one.x - other.x) < tolerance);
    CHECK(std::abs(one.y - other.y) < tolerance);
    CHECK(std::abs(one.heading - other.heading) < tolerance);
}

}  // namespace

TEST_CASE("reference: a robot drives and spins as its wheels' grip allows") {
    const Parameters p;
    const double v = top_speed(p);
    Planar straight(p, {{-0.1, 0, 0, 0, 0, 0}}, std::nullopt);
    drive(straight);
    run(straight, 1);
    // Load shifts 0.2 ms late, which is worth 13 um.
    CHECK(straight.robot(0).x + 0.1 == doctest::Approx(v - v * v / (2 * grip(p))).epsilon(2e-4));
    CHECK(straight.robot(0).y == 0);
    CHECK(straight.robot(0).vx == doctest::Approx(v).epsilon(1e-9));

    Planar spinning(p, {{0, 0, 0, 0, 0, 0}}, std::nullopt);
    spinning.set_command(0, -1, 1);
    run(spinning, 0.5);
    CHECK(spinning.robot(0).spin == doctest::Approx(2 * v / p.axle).epsilon(1e-9));
    CHECK(std::hypot(spinning.robot(0).x, spinning.robot(0).y) < 1e-12);
}

TEST_CASE("reference: a box that slides stops after v^2 / (2 mu g), one that spins after w^2 / (2 alpha)") {
    Parameters p;
    Planar sliding(p, {}, Body{0, 0, 0.3, 0.3, 0, 0});
    run(sliding, 0.2);
    CHECK(sliding.box().x == doctest::Approx(0.3 * 0.3 / (2 * p.mu_box * kGravity)).epsilon(2e-3));
    CHECK(std::abs(sliding.box().heading - 0.3) < 1e-6);

    p.mu_box = 0.58;
    Planar spinning(p, {}, Body{0, 0, 0, 0, 0, 5});
    run(spinning, 0.2);
    const double r = std::hypot(p.box_length, p.box_width) / 2, gyration2 = r * r / 3;
    const double alpha = p.mu_box * kGravity * r / gyration2;
    CHECK(spinning.box().heading == doctest::Approx(25 / (2 * alpha)).epsilon(2e-3));  // 6.90 degrees
    CHECK(std::hypot(spinning.box().x, spinning.box().y) < 1e-9);
}

TEST_CASE("reference: a box that slides and spins goes where its equations of motion send it, and only loses energy") {
    Parameters p;
    p.mu_box = 0.58;
    for (const double spin : {1.0, 3.0, 8.0}) {
        Planar world(p, {}, Body{0, 0, 0, 0.3, 0, spin});
        const double thrown = world.energy();
        double before = thrown, rise = 0;
        for (int i = 0; i < 20000; ++i) {
            world.advance(1);
            rise = std::max(rise, world.energy() - before);
            before = world.energy();
        }
        CHECK(rise < 1e-6 * thrown);
        const Thrown expected = throw_box(p, 0.3, spin);
        CHECK(std::hypot(world.box().x, world.box().y) == doctest::Approx(expected.way).epsilon(2e-3));
        CHECK(world.box().heading == doctest::Approx(expected.turn).epsilon(2e-3));
    }
}

TEST_CASE("reference: n robots in the middle of the long face move the box if their traction exceeds its friction") {
    constexpr double margin = 0.02;
    for (const bool sprung : {false, true})
        for (const int n : {1, 2, 3}) {
            CAPTURE(sprung);
            CAPTURE(n);
            Parameters p;
            p.sprung = sprung;
            // Robots start pressed on as hard as they can: there is no blow, which would count as well.
            const double compression = traction(p) / (sprung ? p.bumper_stiffness : p.contact_stiffness);
            const double threshold = n * traction(p) / (p.box_mass * kGravity);
            struct Pushed {
                double way, acceleration;
            };
            const auto push = [&](double mu) {
                p.mu_box = mu;
                Planar world(p, row(p, n, -compression), Body{});
                drive(world);
                run(world, 0.5);  // what the start did is over
                const double before = world.box().vy;
                run(world, 0.5);
                return Pushed{world.box().y, (world.box().vy - before) / 0.5};
            };
            const double expected = margin * n * traction(p) / (p.box_mass + n * p.robot_mass);
            CHECK(push(threshold * (1 + margin)).way < 1e-4);
            CHECK(push(threshold * (1 - margin)).acceleration == doctest::Approx(expected).epsilon(1e-3));
        }
}

TEST_CASE("reference: one rigid blow moves the box as far as its momentum goes") {
    Parameters p;
    p.sprung = false;
    p.contact_stiffness = 1e7;  // a blow shorter than what friction needs to stop the box, as the formula has it
    p.time_step = 1e-6;
    Planar world(p, row(p, 1, 0.03), Body{});
    drive(world);
    world.advance(400000);
    const double momentum = p.robot_mass * top_speed(p);
    const double way =
        momentum * momentum / (2 * (p.robot_mass + p.box_mass) * (p.mu_box * p.box_mass * kGravity - traction(p)));
    CHECK(world.box().y == doctest::Approx(way).epsilon(0.05));
}

TEST_CASE("reference: feet hardly give way to a blow that they just fail to hold") {
    Parameters p;
    const double force = traction(p);
    // The same blow against a box that stands or slides, and nothing between: along a line, for as long as it moves.
    const auto rammed = [&](double limit) {
        constexpr double dt = 1e-7;
        double depth = 0, robot = top_speed(p), box = 0, way = 0, most = 0;
        for (double t = 0; t < 0.1; t += dt) {
            const double push = std::max(0.0, p.bumper_stiffness * depth + p.bumper_damping * (robot - box));
            most = std::max(most, push);
            if (box > 0 || push > limit) box = std::max(0.0, box + dt * (push - limit) / p.box_mass);
            robot += dt * (force - push) / p.robot_mass;
            depth += dt * (robot - box);
            way += dt * box;
        }
        return std::array<double, 2>{way, most};
    };
    const double most = rammed(1e9)[1];
    for (const double share : {0.9, 0.95}) {
        const double limit = share * most;
        p.mu_box = limit / (p.box_mass * kGravity);
        const auto slid = [&](double foot_stiffness) {
            p.foot_stiffness = foot_stiffness;
            Planar world(p, row(p, 1, 0.03), Body{});
            drive(world);
            run(world, 0.7);
            return world.box().y - force / (4 * foot_stiffness);
        };
        CAPTURE(share);
        CHECK(slid(Parameters{}.foot_stiffness) == doctest::Approx(rammed(limit)[0]).epsilon(0.015));
        CHECK(slid(5e4) > 1.1 * rammed(limit)[0]);
    }
}

// Its figures were made with the parameters set here; benchmarks/validation_outside.py says more about it.
TEST_CASE("reference: rows push and turn the box as in a simulator from outside") {
    Parameters p;
    p.sprung = false;
    p.mu_box = 0.58;
    const auto push = [&](double offset, double seconds) {
        const double y = 0.2;  // 210 mm before the wall
        std::vector<Body> robots;
        for (const double x : {-0.0725, 0.0, 0.0725})
            robots.push_back({offset + x, y - p.box_width / 2 - p.robot_radius - 0.005, kHalfPi, 0, 0, 0});
        Planar world(p, robots, Body{0, y, 0, 0, 0, 0});
        drive(world);
        run(world, seconds);
        return world.box();
    };
    constexpr double degrees = 2 * kHalfPi / 180;
    CHECK(push(0, 1.5).y - 0.2 == doctest::Approx(0.18179).epsilon(1e-3));
    CHECK(push(0.02, 1.7).heading == doctest::Approx(8.481 * degrees).epsilon(1e-3));
    CHECK(push(0.03, 1.7).heading == doctest::Approx(15.107 * degrees).epsilon(1e-3));
    CHECK(push(0.06, 2.0).heading == doctest::Approx(27.520 * degrees).epsilon(1e-3));

    Planar thrown(p, {}, Body{0, 0, 0, 0.3, 0, 3});
    run(thrown, 0.3);
    CHECK(std::hypot(thrown.box().x, thrown.box().y) == doctest::Approx(11.076e-3).epsilon(1e-3));
}

TEST_CASE("reference: bumpers give way by force over stiffness, and two in series by twice that") {
    const Parameters p;
    const double compression = traction(p) / p.bumper_stiffness;
    Planar wall(p, {{0.4, 0, 0, 0, 0, 0}}, std::nullopt);
    drive(wall);
    run(wall, 1.5);
    CHECK(wall.robot(0).x + p.robot_radius - p.arena_size / 2 == doctest::Approx(compression).epsilon(1e-3));

    Planar box(p, row(p, 1, 0.01), Body{});
    drive(box);
    run(box, 1.5);
    CHECK(box.robot(0).y + p.robot_radius + p.box_width / 2 == doctest::Approx(compression).epsilon(2e-3));
    CHECK(box.push() == doctest::Approx(traction(p)).epsilon(1e-3));

    Planar head_on(p, {{-0.05, 0, 0, 0, 0, 0}, {0.05, 0, 2 * kHalfPi, 0, 0, 0}}, std::nullopt);
    drive(head_on);
    run(head_on, 1.5);
    const double distance = head_on.robot(1).x - head_on.robot(0).x;
    CHECK(2 * p.robot_radius - distance == doctest::Approx(2 * compression).epsilon(1e-3));
}

TEST_CASE("reference: a bumper whose travel is used up stops as a rigid contact does") {
    Parameters p;
    p.bumper_stiffness = 10;  // would give way by 52 mm
    p.bumper_damping = 1;
    Planar world(p, {{0.4, 0, 0, 0, 0, 0}}, std::nullopt);
    drive(world);
    run(world, 1.5);
    const double at_stop = traction(p) - p.bumper_stiffness * p.bumper_travel;
    const double depth = world.robot(0).x + p.robot_radius - p.arena_size / 2;
    CHECK(depth == doctest::Approx(p.bumper_travel + at_stop / p.contact_stiffness).epsilon(2e-3));
}

TEST_CASE("reference: the mirrored world does the mirrored thing, and the turned world the turned one") {
    for (const bool sprung : {false, true}) {
        CAPTURE(sprung);
        const auto plain = melee(
            sprung, [](const Body& b) { return b; }, false);
        const auto mirrored = melee(
            sprung, [](const Body& b) { return Body{b.x, -b.y, -b.heading, b.vx, -b.vy, -b.spin}; }, true);
        const auto turned = melee(
            sprung, [](const Body& b) { return Body{-b.y, b.x, b.heading + kHalfPi, -b.vy, b.vx, b.spin}; }, false);
        for (std::size_t i = 0; i < plain.size(); ++i) {
            const Body& b = plain[i];
            check_same(mirrored[i], {b.x, -b.y, -b.heading, 0, 0, 0});
            check_same(turned[i], {-b.y, b.x, b.heading + kHalfPi, 0, 0, 0});
        }
    }
}

TEST_CASE("reference: a box that is pushed with 95 per cent of its limit stands still") {
    Parameters p;
    p.mu_box = 2 * traction(p) / (p.box_mass * kGravity) / 0.95;
    Planar world(p, row(p, 2, 0), Body{});
    drive(world);
    run(world, 0.5);
    const double before = world.box().y;
    const double bristle = 2 * traction(p) / (4 * p.foot_stiffness);
    CHECK(before == doctest::Approx(bristle).epsilon(1e-2));
    run(world, 2);
    CHECK(std::abs(world.box().y - before) < 1e-9);
}

TEST_CASE("reference: a push above the floor loads the feet ahead of it") {
    Parameters p;
    p.shift_loads = true;
    Planar world(p, row(p, 1, 0), Body{});
    drive(world);
    run(world, 1);
    const auto& loads = world.foot_loads();  // the box is pushed to its left
    const double ahead = loads[2] + loads[3], behind = loads[0] + loads[1];
    CHECK(ahead + behind == doctest::Approx(p.box_mass * kGravity));
    CHECK((ahead - behind) * p.box_width / 2 == doctest::Approx(traction(p) * p.push_height).epsilon(1e-3));
    CHECK(loads[2] == doctest::Approx(loads[3]));
}

TEST_CASE("reference: a parameter out of its range is an error") {
    Parameters p;
    p.time_step = 0;
    CHECK_THROWS_AS(Planar(p, {}, std::nullopt), std::invalid_argument);
    p = {};
    p.restitution = 1.5;
    CHECK_THROWS_AS(Planar(p, {}, std::nullopt), std::invalid_argument);
    p = {};
    CHECK_THROWS_AS(Planar(p, {{std::nan(""), 0, 0, 0, 0, 0}}, std::nullopt), std::invalid_argument);
}

// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "episode.hpp"
#include "error.hpp"
#include "fixture.hpp"
#include "rng.hpp"
#include "world/world.hpp"

using namespace swarmevo;

namespace {

std::string errors_of(const swe_scene_config& config) {
    try {
        const Scene scene(config);
    } catch (const Error& error) {
        CHECK(error.status() == SWE_INVALID_ARGUMENT);
        return error.what();
    }
    return "";
}

bool names(const std::string& message, const std::string& field) {
    return message.find(field) != std::string::npos;
}

}  // namespace

TEST_CASE("the paper's world is accepted and its steps are counted") {
    const Fixture fixture;
    const Scene scene = fixture.scene();
    CHECK(scene.robots == 5);
    CHECK(scene.control_steps == 1800);
    CHECK(scene.substeps == 2);
}

TEST_CASE("a config that nobody filled names every field") {
    swe_scene_config config;
    swe_scene_config_init(&config);
    const std::string errors = errors_of(config);
    for (const char* field : {"arena.shape",
                              "arena.wall_height",
                              "movables: their number",
                              "obstacles: their number",
                              "ground.grey",
                              "goals: their number",
                              "robot.radius",
                              "robot.height",
                              "robot.mass",
                              "robot.centre_of_mass",
                              "robot.wheel_radius",
                              "robot.axle_length",
                              "robot.top_speed",
                              "robot.caster_offset",
                              "robot.caster_clearance",
                              "robot.sensors",
                              "team.robots",
                              "team.start",
                              "team.start_jitter[0]",
                              "sensors.infrared_yaw_deg",
                              "sensors.infrared_curve points",
                              "sensors.infrared_target",
                              "sensors.touch_yaw_deg",
                              "sensors.touch_half_width_deg",
                              "sensors.touch_range",
                              "sensors.touch_mode",
                              "noise.infrared",
                              "noise.infrared_at_contact",
                              "noise.wheels",
                              "noise.rf",
                              "physics.time_step",
                              "physics.gravity",
                              "physics.wheel_friction",
                              "physics.side_friction",
                              "physics.contact_erp",
                              "physics.contact_cfm",
                              "episode.horizon",
                              "episode.control_period",
                              "episode.until"})
        CHECK_MESSAGE(names(errors, field), std::string(field) << " is not in: " << errors);
}

TEST_CASE("bad values are named") {
    using Spoil = std::function<void(swe_scene_config&)>;
    constexpr double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
    const std::pair<const char*, Spoil> cases[] = {
        {"movables[0].mass", [](auto& c) { c.movables[0].mass = -0.24; }},
        {"movables[0].mass", [](auto& c) { c.movables[0].mass = infinity; }},
        {"arena.size", [](auto& c) { c.arena.size[1] = nan; }},
        {"team.robots", [](auto& c) { c.team.robots = 0; }},
        {"team.robots", [](auto& c) { c.team.robots = 1000000000; }},
        {"emitters[0].strength", [](auto& c) { std::swap(c.emitters[0].strength[0], c.emitters[0].strength[1]); }},
        {"sensors.infrared_curve[3]", [](auto& c) { c.sensors.infrared_curve[3][0] = 0.001; }},
        {"sensors.infrared_curve[0][1]", [](auto& c) { c.sensors.infrared_curve[0][1] = 0; }},
        {"robot.centre_of_mass", [](auto& c) { c.robot.centre_of_mass = 0.06; }},
        {"robot.caster_offset", [](auto& c) { c.robot.caster_offset = 0.04; }},
        {"robot.axle_length", [](auto& c) { c.robot.axle_length = 0.08; }},
        {"robot.axle_length", [](auto& c) { c.robot.axle_length = 0.058; }},  // the tyres' corners stick out
        {"robot.wheel_radius: expected at most half of robot.height and robot.radius (0.025 m), got 0.026 m",
         [](auto& c) { c.robot.wheel_radius = 0.026; }},
        {"robot.wheel_radius", [](auto& c) { c.robot.wheel_radius = 0.036, c.robot.height = 0.2; }},
        {"robot.caster_clearance: expected at most a tenth of robot.caster_offset (0.003 m)",
         [](auto& c) { c.robot.caster_clearance = 0.0031; }},
        {"robot.radius: expected at most half of arena.size", [](auto& c) { c.robot.radius = 0.6, c.team.robots = 1; }},
        {"movables[0].pose: expected it inside the arena", [](auto& c) { c.movables[0].size[0] = 1.2; }},
        {"movables[0].pose: expected it inside the arena",
         [](auto& c) { c.movables[0].size[0] = c.movables[0].size[1] = 0.9, c.movables[0].pose[2] = 0.78; }},
        {"episode.control_period", [](auto& c) { c.episode.control_period = 0.075; }},  // 1.5 time steps
        {"episode.horizon", [](auto& c) { c.episode.horizon = 180.05; }},
        {"episode.horizon",
         [](auto& c) {
             c.episode = {1e5, 0.0005, SWE_UNTIL_HORIZON}, c.physics.time_step = 0.0005;
         }},
        {"movables[0].pose", [](auto& c) { c.movables[0].pose[1] = 0.45; }},
        {"team.start_poses", [](auto& c) { c.team.start_poses = nullptr; }},
        {"struct_size", [](auto& c) { c.struct_size -= 8; }},
    };
    for (const auto& [field, spoil] : cases) {
        Fixture fixture;
        spoil(fixture.config);
        const std::string errors = errors_of(fixture.config);
        const std::string expected = field;  // no message takes a structured binding
        CHECK_MESSAGE(names(errors, expected), expected << " is not in: " << errors);
    }
}

TEST_CASE("robots must stand free, jitter included, and all who do not are named") {
    const double south = -kPi / 2;
    const Fixture fixture({0, -0.4, south, 0.05, -0.4, south, 0.49, 0, south, 0, 0.345, south, 0, NAN, 0});
    const std::string errors = errors_of(fixture.config);
    CHECK(names(errors, "start_poses[1]: expected at least"));
    CHECK(names(errors, "start_poses[2]: expected the robot inside the arena"));
    CHECK(names(errors, "start_poses[3]: expected the robot clear of movables[0]"));
    CHECK(names(errors, "start_poses[4]: expected three numbers"));

    Fixture jittery;
    jittery.config.team.start_jitter[0] = 0.05;
    CHECK(names(errors_of(jittery.config), "start_poses[1]"));
}

TEST_CASE("a box that its friction with the floor tips is refused") {
    Fixture fixture;
    fixture.config.movables[0].friction = 0.8;
    double(&size)[3] = fixture.config.movables[0].size;
    size[2] = 0.18 / 0.8 - 1e-6;
    CHECK(errors_of(fixture.config) == "");
    size[2] = 0.23;
    CHECK(errors_of(fixture.config) ==
          "movables[0].size: expected one that slides before it tips, at most 0.225 m high (its shorter side by "
          "movables[0].feet, over .friction), got 0.23 m");
    fixture.config.movables[0].friction = 0;
    CHECK(errors_of(fixture.config) == "");
    size[0] = size[1] = 0.01;
    fixture.config.movables[0].friction = 0.8;
    CHECK(names(errors_of(fixture.config), "at most 0.0125 m high"));
}

TEST_CASE("a robot that cannot stand is refused") {
    Fixture fixture;
    swe_robot_config& robot = fixture.config.robot;
    fixture.config.physics.drive = SWE_DRIVE_ARTICULATED;
    fixture.config.physics.time_step = 0.004;
    robot.height = 0.2;
    robot.caster_offset = 0.005;
    robot.centre_of_mass = 0.049;
    CHECK(errors_of(fixture.config) == "");
    robot.centre_of_mass = 0.051;  // leans by a tenth, its centre then above the caster
    CHECK(errors_of(fixture.config) ==
          "robot.centre_of_mass: expected less than 0.05 m, or the robot falls over its caster, got 0.051 m: lower it, "
          "reduce robot.caster_clearance or enlarge robot.caster_offset");
    robot.caster_clearance = 0.0001;
    CHECK(errors_of(fixture.config) == "");
    robot.caster_clearance = 0;
    CHECK(errors_of(fixture.config) == "");
}

TEST_CASE("a robot that falls on its side as it skids is left to the articulated model") {
    Fixture fixture;
    fixture.config.physics.time_step = 0.004;
    fixture.config.physics.wheel_friction = 1;
    fixture.config.robot.centre_of_mass = 0.0265;  // half the axle
    CHECK(errors_of(fixture.config) == "");
    fixture.config.robot.centre_of_mass = 0.027;
    CHECK(names(errors_of(fixture.config), "robot.centre_of_mass: expected at most 0.0265 m"));
    fixture.config.physics.wheel_friction = 0.9;
    CHECK(errors_of(fixture.config) == "");
    fixture.config.physics.wheel_friction = 1;
    fixture.config.robot.axle_length = 0.03;
    CHECK(names(errors_of(fixture.config), "robot.centre_of_mass: expected at most 0.015 m"));
    fixture.config.physics.drive = SWE_DRIVE_ARTICULATED;
    CHECK(errors_of(fixture.config) == "");
}

TEST_CASE("a number with too few digits to compute with is refused") {
    Fixture fixture;
    for (double* value : {&fixture.config.physics.wheel_friction, &fixture.config.noise.rf}) {
        *value = 7.6e-321;
        CHECK(names(errors_of(fixture.config), "expected 0 or a number that arithmetic resolves"));
        *value = std::numeric_limits<double>::min();
        CHECK(errors_of(fixture.config) == "");
        *value = 0;
        CHECK(errors_of(fixture.config) == "");
    }
}

TEST_CASE("the articulated drive takes small steps and sprung bumpers") {
    Fixture fixture;
    fixture.config.physics.drive = SWE_DRIVE_ARTICULATED;
    CHECK(names(errors_of(fixture.config), "physics.time_step: expected at most 0.004 s with the articulated drive"));
    fixture.config.physics.time_step = 0.004;
    CHECK(errors_of(fixture.config) == "");
    fixture.config.robot.bumper = SWE_BUMPER_RIGID;
    CHECK(names(errors_of(fixture.config), "robot.bumper: expected sprung with the articulated drive"));
    fixture.config.physics.drive = SWE_DRIVE_DRIVEN_CONTACTS;
    CHECK(errors_of(fixture.config) == "");
}

TEST_CASE("the articulated robot's chassis has a mass, a centre above the floor and inertia wherever it is accepted") {
    const auto stands = [](const Fixture& fixture) {
        const Scene scene(fixture.config);
        World world(scene, starts_of(scene));  // ODE asserts that inertia is positive
        for (int i = 0; i < 200; ++i) world.step();
        world.fold_state(0);
        return world.extremes().upright > 0.99;
    };
    Fixture fixture;
    fixture.config.physics.drive = SWE_DRIVE_ARTICULATED;
    fixture.config.physics.time_step = 0.004;
    swe_robot_config& robot = fixture.config.robot;
    robot.centre_of_mass = 0.12 * robot.wheel_radius + 1e-5;
    CHECK(stands(fixture));
    robot.centre_of_mass = 0.12 * robot.wheel_radius;
    CHECK(names(errors_of(fixture.config), "robot.centre_of_mass: expected more than 0.00246 m"));
    fixture.config.physics.drive = SWE_DRIVE_DRIVEN_CONTACTS;
    CHECK(errors_of(fixture.config) == "");

    fixture.config.physics.drive = SWE_DRIVE_ARTICULATED;  // as much inertia in the wheels as may be
    robot.centre_of_mass = 0.015;
    for (const double wheel : {0.001, 0.0249, 0.0349}) {
        robot.wheel_radius = wheel;
        robot.height = std::max(0.05, 2 * wheel);
        robot.axle_length = std::max(0.005, 2 * std::sqrt(0.035 * 0.035 - wheel * wheel) - 1e-9);
        CHECK(stands(fixture));
    }
}

TEST_CASE("a random start needs room") {
    Fixture fixture;
    fixture.config.team.start = SWE_START_RANDOM;
    CHECK(errors_of(fixture.config) == "");
    fixture.config.team.robots = 64;
    CHECK(names(errors_of(fixture.config), "team.start_region"));
    fixture.config.team.robots = 5;
    fixture.config.team.start_region[0] = -0.49;
    CHECK(names(errors_of(fixture.config), "team.start_region[0]"));
    std::swap(fixture.config.team.start_region[2], fixture.config.team.start_region[3]);
    fixture.config.team.start_region[0] = -0.45;
    CHECK(names(errors_of(fixture.config), "team.start_region"));
}

TEST_CASE("of a start region only what is clear of the box counts, wherever the box is") {
    Fixture fixture;
    fixture.config.team.start = SWE_START_RANDOM;
    const auto errors_in = [&](double west, double east, double south, double north, unsigned robots) {
        const double region[] = {west, east, south, north};
        std::copy_n(region, 4, fixture.config.team.start_region);
        fixture.config.team.robots = robots;
        return errors_of(fixture.config);
    };
    // Beside the box, as small as the box: all of it is free.
    CHECK(errors_in(-0.1, 0.1, -0.4, -0.2, 3) == "");
    // Under the box, or within a radius of it: none is.
    CHECK(errors_in(-0.1, 0.1, 0.3, 0.4, 1) ==
          "team.start_region: expected a place for each of 1, clear of all that stands there and of each other, got 0 "
          "m^2 "
          "for their centres: enlarge it or move it away");
    CHECK(names(errors_in(-0.1, 0.1, 0.225, 0.25, 1), "got 0 m^2"));
    CHECK(errors_in(-0.1, 0.1, 0.2, 0.25, 1) == "");
    // One robot needs no more than a place.
    CHECK(errors_in(0, 0.001, 0, 0.001, 1) == "");
    CHECK(names(errors_in(0, 0.001, 0, 0.001, 2), "team.start_region"));
    // The box stands across a corner of it.
    fixture.box_at(0.2, 0.1, 0.8);
    CHECK(names(errors_in(0, 0.4, -0.1, 0.3, 20), "team.start_region"));
    CHECK(errors_in(-0.45, 0.45, -0.45, 0.45, 5) == "");
}

TEST_CASE("where a random start is accepted, all robots find a place") {
    Fixture densest;
    densest.config.team.start = SWE_START_RANDOM;
    densest.config.team.robots = 49;
    const Scene full = densest.scene();
    for (std::uint32_t repeat = 0; repeat < 20; ++repeat) CHECK_NOTHROW(draw_starts(full, {0, 0, 0, repeat}));
    densest.config.team.robots = 50;
    CHECK(names(errors_of(densest.config), "team.start_region"));

    unsigned accepted = 0, refused = 0;
    for (std::uint32_t i = 0; i < 1000; ++i) {
        Fixture fixture;
        const EpisodeKey key = {i, 0, 0, 0};
        const auto words = draw(key, Purpose::start, 0, 0), more = draw(key, Purpose::start, 0, 1);
        fixture.box_at(0.3 * symmetric(words[0]), 0.3 * symmetric(words[1]), kPi * symmetric(words[2]));
        const double x = 0.46 * symmetric(words[3]), y = 0.46 * symmetric(more[0]);
        const double width = 0.5 * uniform(more[1]), depth = 0.5 * uniform(more[2]);
        const double region[] = {x, std::min(0.465, x + width), y, std::min(0.465, y + depth)};
        std::copy_n(region, 4, fixture.config.team.start_region);
        fixture.config.team.start = SWE_START_RANDOM;
        fixture.config.team.robots = 1 + more[3] % 12;
        if (!errors_of(fixture.config).empty()) {
            ++refused;
            continue;
        }
        ++accepted;
        const Scene scene = fixture.scene();
        for (std::uint32_t repeat = 0; repeat < 10; ++repeat) CHECK_NOTHROW(draw_starts(scene, {i, 1, 0, repeat}));
    }
    CHECK(accepted > 100);
    CHECK(refused > 100);
}

TEST_CASE("a point is separated from a rectangle along the shortest way") {
    const Separation face = separate_point_from_rectangle(0.5, 3, 2, 1);
    CHECK(face.distance == doctest::Approx(2));
    CHECK(face.normal_y == 1);
    const Separation corner = separate_point_from_rectangle(5, 5, 2, 1);
    CHECK(corner.distance == doctest::Approx(5));
    CHECK(corner.normal_x == doctest::Approx(0.6));
    const Separation inside = separate_point_from_rectangle(-1.5, 0.2, 2, 1);
    CHECK(inside.distance == doctest::Approx(-0.5));
    CHECK(inside.normal_x == -1);
    CHECK(inside.nearest_x == -2);
}

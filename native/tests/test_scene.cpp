// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "error.hpp"
#include "fixture.hpp"

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
    for (const char* field : {"arena.size",
                              "arena.wall_height",
                              "arena.target_wall",
                              "box.size[0]",
                              "box.mass",
                              "box.pose[2]",
                              "emitter.position[1]",
                              "emitter.range",
                              "emitter.strength[0]",
                              "emitter.reach",
                              "robot.radius",
                              "robot.height",
                              "robot.mass",
                              "robot.centre_of_mass",
                              "robot.wheel_radius",
                              "robot.axle_length",
                              "robot.top_speed",
                              "robot.caster_offset",
                              "robot.caster_clearance",
                              "team.robots",
                              "team.start",
                              "team.start_jitter[0]",
                              "sensors.infrared_yaw_deg[7]",
                              "sensors.infrared_curve points",
                              "sensors.infrared_target",
                              "sensors.touch_yaw_deg[3]",
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
                              "physics.box_friction",
                              "physics.side_friction",
                              "physics.contact_erp",
                              "physics.contact_cfm",
                              "episode.horizon",
                              "episode.control_period"})
        CHECK_MESSAGE(names(errors, field), field << " is not in: " << errors);
}

TEST_CASE("bad values are named") {
    using Spoil = std::function<void(swe_scene_config&)>;
    constexpr double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
    const std::pair<const char*, Spoil> cases[] = {
        {"box.mass", [](auto& c) { c.box.mass = -0.24; }},
        {"box.mass", [](auto& c) { c.box.mass = infinity; }},
        {"arena.size", [](auto& c) { c.arena.size = nan; }},
        {"team.robots", [](auto& c) { c.team.robots = 0; }},
        {"team.robots", [](auto& c) { c.team.robots = 1000000000; }},
        {"emitter.strength", [](auto& c) { std::swap(c.emitter.strength[0], c.emitter.strength[1]); }},
        {"sensors.infrared_curve[3]", [](auto& c) { c.sensors.infrared_curve[3][0] = 0.001; }},
        {"sensors.infrared_curve[0][1]", [](auto& c) { c.sensors.infrared_curve[0][1] = 0; }},
        {"robot.centre_of_mass", [](auto& c) { c.robot.centre_of_mass = 0.06; }},
        {"robot.caster_offset", [](auto& c) { c.robot.caster_offset = 0.04; }},
        {"robot.axle_length", [](auto& c) { c.robot.axle_length = 0.08; }},
        {"episode.control_period", [](auto& c) { c.episode.control_period = 0.075; }},  // 1.5 time steps
        {"episode.horizon", [](auto& c) { c.episode.horizon = 180.05; }},
        {"episode.horizon",
         [](auto& c) {
             c.episode = {1e5, 0.0005}, c.physics.time_step = 0.0005;
         }},
        {"box.pose", [](auto& c) { c.box.pose[1] = 0.45; }},
        {"team.start_poses", [](auto& c) { c.team.start_poses = nullptr; }},
        {"struct_size", [](auto& c) { c.struct_size -= 8; }},
    };
    for (const auto& [field, spoil] : cases) {
        Fixture fixture;
        spoil(fixture.config);
        const std::string errors = errors_of(fixture.config);
        CHECK_MESSAGE(names(errors, field), field << " is not in: " << errors);
    }
}

TEST_CASE("robots must stand free, jitter included, and all who do not are named") {
    const double south = -kPi / 2;
    const Fixture fixture({0, -0.4, south, 0.05, -0.4, south, 0.49, 0, south, 0, 0.345, south, 0, NAN, 0});
    const std::string errors = errors_of(fixture.config);
    CHECK(names(errors, "start_poses[1]: expected at least"));
    CHECK(names(errors, "start_poses[2]: expected the robot inside the arena"));
    CHECK(names(errors, "start_poses[3]: expected the robot clear of the box"));
    CHECK(names(errors, "start_poses[4]: expected three numbers"));

    Fixture jittery;
    jittery.config.team.start_jitter[0] = 0.05;
    CHECK(names(errors_of(jittery.config), "start_poses[1]"));
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

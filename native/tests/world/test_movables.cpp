// SPDX-License-Identifier: BSD-3-Clause
// Several movables, obstacles and arenas of other shapes, against force balance and against their outlines.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "epuck.hpp"
#include "fixture.hpp"
#include "rng.hpp"
#include "world/world.hpp"

namespace swarmevo {
namespace {

swe_movable_config movable(std::int32_t shape, double length, double width, double mass, double x, double y,
                           double heading = 0) {
    return {shape, {length, width, 0.03}, mass, 0.62, 1, {x, y, heading}, {0, 0, 0}, SWE_START_POSES, {}};
}

void set_movables(Fixture& fixture, const std::vector<swe_movable_config>& movables) {
    std::copy(movables.begin(), movables.end(), fixture.config.movables);
    fixture.config.n_movables = static_cast<std::uint32_t>(movables.size());
}

void add_obstacle(Fixture& fixture, std::int32_t shape, double length, double width, double x, double y,
                  double heading = 0) {
    fixture.config.obstacles[fixture.config.n_obstacles++] = {shape, {length, width, 0.1}, {x, y, heading}};
}

// Deepest overlap of movables with each other, with obstacles and with the walls [m].
double deepest(const Scene& scene, const World& world) {
    double depth = 0;
    for (unsigned i = 0; i < scene.movables.size(); ++i) {
        const Figure& figure = scene.movables[i].figure;
        const Pose pose = world.movable_pose(i);
        depth = std::max(depth, -scene.arena.distance(figure, pose));
        for (const Obstacle& o : scene.obstacles) depth = std::max(depth, -distance(figure, pose, o.figure, o.pose));
        for (unsigned j = 0; j < i; ++j)
            depth = std::max(depth, -distance(figure, pose, scene.movables[j].figure, world.movable_pose(j)));
    }
    return depth;
}

void drive(World& world, const Scene& scene, double speed) {
    for (unsigned i = 0; i < scene.robots; ++i) world.set_rim_speeds(i, speed, speed);
}

}  // namespace

TEST_CASE("robots push a cylinder if their traction exceeds its friction, whatever its feet's places") {
    for (const double feet : {1.0, 0.5})
        for (const double share : {0.9, 1.1}) {
            Fixture fixture({0, -0.2, kPi / 2});
            const double push = traction_limit(Fixture().scene());
            const double mass = share * push / (0.62 * 9.81);
            set_movables(fixture, {movable(SWE_SHAPE_CYLINDER, 0.1, 0.1, mass, 0, -0.1)});
            fixture.config.movables[0].feet = feet;
            fixture.without_noise();
            const Scene scene = fixture.scene();
            World world(scene, starts_of(scene));
            drive(world, scene, 0.05);
            run(world, 4, scene.physics.time_step);
            CAPTURE(share);
            CHECK((world.movable_pose(0).y > -0.05) == (share < 1));
            CHECK(std::abs(world.movable_pose(0).x) < 1e-6);
        }
}

TEST_CASE("movables in a row are pushed if the traction exceeds the friction of all, and touch") {
    for (const std::int32_t shape : {SWE_SHAPE_BOX, SWE_SHAPE_CYLINDER})
        for (const double share : {0.9, 1.1}) {
            Fixture fixture({0, -0.3, kPi / 2});
            const double mass = share * traction_limit(Fixture().scene()) / (0.62 * 9.81) / 3;
            set_movables(fixture, {movable(shape, 0.08, 0.08, mass, 0, -0.2), movable(shape, 0.08, 0.08, mass, 0, -0.1),
                                   movable(shape, 0.08, 0.08, mass, 0, 0)});
            fixture.without_noise();
            const Scene scene = fixture.scene();
            World world(scene, starts_of(scene));
            drive(world, scene, 0.05);
            run(world, 6, scene.physics.time_step);
            CAPTURE(shape);
            CAPTURE(share);
            CHECK((world.movable_pose(2).y > 0.03) == (share < 1));
            CHECK(deepest(scene, world) < 1e-5);
            for (const unsigned i : {1u, 2u})
                CHECK(world.movable_pose(i).y - world.movable_pose(i - 1).y == doctest::Approx(0.08).epsilon(2e-3));
        }
}

TEST_CASE("an obstacle stops what is pushed against it, and robots, as a wall does") {
    for (const std::int32_t shape : {SWE_SHAPE_BOX, SWE_SHAPE_CYLINDER}) {
        Fixture fixture({0, -0.3, kPi / 2, 0.3, -0.3, kPi / 2});
        set_movables(fixture, {movable(shape, 0.08, 0.08, 0.02, 0, -0.2)});
        add_obstacle(fixture, SWE_SHAPE_BOX, 0.6, 0.02, 0.1, 0.1);
        fixture.without_noise();
        const Scene scene = fixture.scene();
        World world(scene, starts_of(scene));
        drive(world, scene, 0.1);
        run(world, 8, scene.physics.time_step);
        CHECK(world.movable_pose(0).y == doctest::Approx(0.05).epsilon(2e-3));
        CHECK(deepest(scene, world) < 1e-5);
        // A robot presses its own bumper in, as at a wall: by its traction over the stiffness.
        const double pressed = traction_limit(scene) / scene.robot.bumper_stiffness;
        CHECK(world.robot_pose(1).y == doctest::Approx(0.09 - scene.robot.radius + pressed).epsilon(2e-3));
    }
}

TEST_CASE("a round wall holds robots and movables") {
    Fixture fixture({0.1, 0, 0});
    fixture.config.arena.shape = SWE_ARENA_SHAPE_CIRCLE;
    fixture.config.n_goals = 0;
    set_movables(fixture, {movable(SWE_SHAPE_CYLINDER, 0.08, 0.08, 0.02, 0.2, 0)});
    fixture.without_noise();
    const Scene scene = fixture.scene();
    World world(scene, starts_of(scene));
    drive(world, scene, 0.1);
    run(world, 6, scene.physics.time_step);
    CHECK(world.movable_pose(0).x == doctest::Approx(0.46).epsilon(1e-3));
    CHECK(std::abs(world.movable_pose(0).y) < 1e-3);
}

TEST_CASE("crowds of movables hardly overlap, at any step, with either bumper") {
    for (const std::int32_t bumper : {SWE_BUMPER_SPRUNG, SWE_BUMPER_RIGID})
        for (unsigned number = 0; number < 6; ++number) {
            Fixture fixture;
            fixture.without_noise();
            fixture.config.robot.bumper = bumper;
            std::vector<swe_movable_config> crowd;
            for (int i = 0; i < 9; ++i)
                crowd.push_back(movable(number % 2 ? SWE_SHAPE_BOX : i % 2 + 1, 0.08,
                                        i % 2 && number % 2 == 0 ? 0.08 : 0.06, 0.03, 0.15 * (i % 3 - 1),
                                        0.13 * (i / 3), i));
            for (auto& each : crowd)
                if (each.shape == SWE_SHAPE_CYLINDER) each.size[1] = each.size[0];
            set_movables(fixture, crowd);
            add_obstacle(fixture, SWE_SHAPE_CYLINDER, 0.1, 0.1, 0.35, 0.1);
            add_obstacle(fixture, SWE_SHAPE_BOX, 0.1, 0.05, -0.35, 0.2, 0.4);
            const Scene scene = fixture.scene();
            World world(scene, starts_of(scene));
            double worst = 0;
            for (unsigned step = 0; step < 600; ++step) {
                for (unsigned robot = 0; step % 20 == 0 && robot < scene.robots; ++robot) {
                    const auto w = draw({74, 0, number, 0}, Purpose::wheels, robot, step);
                    world.set_rim_speeds(robot, 0.12 * symmetric(w[0]) + 0.04, 0.12 * symmetric(w[1]) + 0.04);
                }
                world.step();
                worst = std::max(worst, deepest(scene, world));
            }
            CAPTURE(bumper);
            CAPTURE(number);
            CHECK(worst < 1e-3);
            CHECK(world.unsolved_steps() == 0);
        }
}

// With nothing elastic both go on at half the speed, and friction stops them: s = v^2 / (2 mu g).
TEST_CASE("what is thrown at one that stands goes on with it, straight, on both drives") {
    for (const std::int32_t drive : {SWE_DRIVE_DRIVEN_CONTACTS, SWE_DRIVE_ARTICULATED})
        for (const std::int32_t shape : {SWE_SHAPE_BOX, SWE_SHAPE_CYLINDER}) {
            Fixture fixture({-1.4, -1.4, 0});
            fixture.arena_of(3).without_noise();
            fixture.config.physics.drive = drive;
            fixture.config.physics.time_step = 0.001;
            set_movables(fixture, {movable(shape, 0.08, 0.08, 0.05, 0, 0), movable(shape, 0.08, 0.08, 0.05, 0, 0.1)});
            const double speed = fixture.config.movables[0].velocity[1] = 0.8;
            const Scene scene = fixture.scene();
            World world(scene, starts_of(scene));
            for (int i = 0; i < 500; ++i) world.step();

            const double gap = 0.02, braking = 2 * 0.62 * fixture.config.physics.gravity;  // v^2 a metre
            const double way = (speed * speed - braking * gap) / 4 / braking;
            INFO(drive, ", ", shape);
            CHECK(world.movable_pose(0).y == doctest::Approx(gap + way).epsilon(0.02));
            CHECK(world.movable_pose(1).y - 0.1 == doctest::Approx(way).epsilon(0.05));
            for (int i = 0; i < 2; ++i) {
                CHECK(std::abs(world.movable_pose(i).x) < 1e-5);
                CHECK(std::abs(world.movable_pose(i).heading) < 1e-4);
            }
        }
}

}  // namespace swarmevo

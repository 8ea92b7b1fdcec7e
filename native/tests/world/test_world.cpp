// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "bumpers.hpp"
#include "epuck.hpp"
#include "error.hpp"
#include "fixture.hpp"
#include "rng.hpp"
#include "world/world.hpp"

using namespace swarmevo;

namespace {

constexpr double kTopSpeed = 6.28 * 0.0205;  // [m/s]
// What contacts may store and give back [J], where overlaps of micrometres are pushed apart.
// A robot at top speed has 7e-4 J.
constexpr double kContactEnergy = 1e-8;
// What friction may give back where it sticks, like a spring [J]. A wheel that is held by all of its friction moves by
// up to kStickSlip until that is so: 0.8 N by 0.2 mm/s in a step of 50 ms is eight times as much.
constexpr double kStickEnergy = 1e-6;
// Of a bumper's travel: by how much the place may err where a bumper is held.
constexpr double kPressError = 0.02;

// Where the box's centre ends when n robots push its face for a minute, from 5 mm before it.
double push(int n, double time_step) {
    Fixture fixture(Fixture::aligned(n));
    fixture.box_at(0, 0.2).without_noise().config.physics.time_step = time_step;
    const Scene scene = fixture.scene();
    World world(scene, starts_of(scene));
    for (int i = 0; i < n; ++i) world.set_rim_speeds(static_cast<unsigned>(i), kTopSpeed, kTopSpeed);
    run(world, 60, time_step);
    CHECK(world.extremes().penetration < 0.001);
    CHECK(world.unsolved_steps() == 0);
    return world.movable_pose(0).y;
}

}  // namespace

TEST_CASE("a robot drives straight at its wheels' rim speed and turns at their difference over the axle") {
    for (const double time_step : {0.001, 0.005, 0.02, 0.05}) {
        Fixture fixture({0, -0.3, kPi / 2, 0.3, -0.3, 0});
        fixture.without_noise().config.physics.time_step = time_step;
        const Scene scene = fixture.scene();
        World world(scene, starts_of(scene));
        world.set_rim_speeds(0, 0.1, 0.1);
        world.set_rim_speeds(1, -0.02, 0.02);
        run(world, 2, time_step);
        // The start costs v^2 / (2 mu g) = 0.5 mm, of which a coarse step sees a part.
        CHECK(world.robot_pose(0).y == doctest::Approx(-0.1).epsilon(0.01));
        CHECK(world.robot_pose(0).x == doctest::Approx(0).scale(1).epsilon(1e-5));
        CHECK(world.robot_pose(1).heading == doctest::Approx(0.04 / 0.053 * 2).epsilon(0.01));
        // Leaning on a caster, its centre of mass is not quite above the axle that it spins about.
        CHECK(std::hypot(world.robot_pose(1).x - 0.3, world.robot_pose(1).y + 0.3) < 5e-4);
    }
}

TEST_CASE("one or two robots never move the box, three and four push it to the wall") {
    const double wall = 0.5 - 0.09;
    for (const double time_step : {0.005, 0.02, 0.05}) {
        CHECK(push(1, time_step) - 0.2 < 1e-4);
        CHECK(push(2, time_step) - 0.2 < 1e-3);  // their blow together
        CHECK(push(3, time_step) == doctest::Approx(wall).epsilon(0.001));
        CHECK(push(4, time_step) == doctest::Approx(wall).epsilon(0.001));
    }
}

TEST_CASE("a blow moves the box as far as its momentum goes, whenever in a step it comes; a bumper takes it") {
    constexpr double speed = 0.12;
    constexpr int kPhases = 12;
    const auto way_of_box = [&](int bumper, double time_step, int phase) {
        Fixture fixture({0, -0.15 - speed * time_step * phase / kPhases, kPi / 2});
        fixture.without_noise().box_at(0, 0).config.physics.time_step = time_step;
        fixture.config.robot.bumper = bumper;
        const Scene scene = fixture.scene();
        World world(scene, starts_of(scene));
        world.set_rim_speeds(0, speed, speed);
        run(world, 2, time_step);
        CHECK(world.robot_pose(0).y > -0.09 - scene.robot.radius - 1e-4);  // it did come
        CHECK(std::abs(world.movable_pose(0).heading) < 1e-6);
        return world.movable_pose(0).y;
    };
    const Scene scene = Fixture().scene();
    const double m = scene.robot.mass, both = m + scene.movables[0].config.mass;
    const double hold = scene.movables[0].config.friction * scene.movables[0].config.mass * scene.physics.gravity;
    const double way = std::pow(m * speed, 2) / (2 * both * (hold - traction_limit(scene)));
    for (const double time_step : {0.005, 0.02, 0.05})
        for (int phase = 0; phase < kPhases; ++phase) {
            CAPTURE(time_step);
            CAPTURE(phase);
            const double rigid = way_of_box(SWE_BUMPER_RIGID, time_step, phase);
            CHECK(std::abs(rigid - way) < 0.1 * way);
            CHECK(std::abs(way_of_box(SWE_BUMPER_SPRUNG, time_step, phase)) < 1e-5);
        }
}

TEST_CASE("robots that press the box to the wall do not enter it") {
    for (const double gap : {0.0, 1e-12, 1e-9, 1e-6, 1e-4}) {
        for (const double time_step : {0.005, 0.02, 0.05}) {
            std::vector<double> poses;
            for (int i = 0; i < 5; ++i) poses.insert(poses.end(), {0.0715 * (i - 2), 0.41 - 0.09 - 0.037, kPi / 2});
            Fixture fixture(poses);
            fixture.box_at(0, 0.41 - gap).without_noise().config.physics.time_step = time_step;
            const Scene scene = fixture.scene();
            World world(scene, starts_of(scene));
            for (unsigned i = 0; i < 5; ++i) world.set_rim_speeds(i, kTopSpeed, kTopSpeed * (1 - 0.01 * i));
            run(world, 2, time_step);
            CHECK(world.unsolved_steps() == 0);
            CHECK(world.extremes().penetration < 1e-4);
            CHECK(world.movable_pose(0).y == doctest::Approx(0.41).epsilon(1e-4));
        }
    }
}

TEST_CASE("a box that slides and turns does so alike in the mirror") {
    for (const double spin : {0.0, 3.0, 10.0}) {
        const auto thrown = [spin](double side) {
            Fixture fixture({-0.45, -0.45, 0});
            fixture.box_at(0, 0, side * 0.3).without_noise();
            const double velocity[] = {-side * 0.3, 0.4, side * spin};
            std::copy_n(velocity, 3, fixture.config.movables[0].velocity);
            const Scene scene = fixture.scene();
            World world(scene, starts_of(scene));
            run(world, 1, scene.physics.time_step);
            return world.movable_pose(0);
        };
        const Pose here = thrown(1), there = thrown(-1);
        CHECK(here.y > 0.01);
        CHECK(there.x == doctest::Approx(-here.x).epsilon(1e-6));
        CHECK(there.y == doctest::Approx(here.y).epsilon(1e-6));
        CHECK(there.heading == doctest::Approx(-here.heading).epsilon(1e-6));
    }
}

TEST_CASE("what is slow to start does not rest for ever") {
    // A robot pushes a box without friction: m v' = F, with the traction that statics leave.
    Fixture fixture({0, -0.126, kPi / 2});
    fixture.box_at(0, 0).without_noise();
    fixture.config.movables[0].friction = 0;
    fixture.config.physics.time_step = 0.0005;
    fixture.config.movables[0].mass = 500;
    fixture.config.physics.contact_cfm = 1e-6;
    const Scene scene = fixture.scene();
    World world(scene, starts_of(scene));
    world.set_rim_speeds(0, kTopSpeed, kTopSpeed);
    run(world, 4, 0.0005);
    CHECK(world.movable_pose(0).y == doctest::Approx(traction_limit(scene) / 500 * 16 / 2).epsilon(0.02));
}

TEST_CASE("walls and other robots stop a robot, as far in as its push presses bumpers") {
    for (const double time_step : {0.005, 0.02, 0.05}) {
        Fixture fixture({0.4, 0, 0, -0.2, 0, 0, -0.1, 0, kPi});
        fixture.without_noise().config.physics.time_step = time_step;
        const Scene scene = fixture.scene();
        World world(scene, starts_of(scene));
        for (unsigned i = 0; i < 3; ++i) world.set_rim_speeds(i, kTopSpeed, kTopSpeed);
        run(world, 1.5, time_step);
        const double depth = traction_limit(scene) / scene.robot.bumper_stiffness;
        const double error = kPressError * scene.robot.bumper_travel;
        CHECK(std::abs(world.robot_pose(0).x - 0.465 - depth) < error);
        // Each of the two gives way.
        CHECK(std::abs(world.robot_pose(2).x - world.robot_pose(1).x - 0.07 + 2 * depth) < 2 * error);
        CHECK(world.extremes().penetration < 0.001);
    }
}

TEST_CASE("a robot that drives into a corner presses on both walls and stays") {
    const auto end_of_drive = [](int drive, int bumper, double time_step, double deepest) {
        CAPTURE(drive);
        CAPTURE(bumper);
        CAPTURE(time_step);
        Fixture fixture({0.4, -0.4, -kPi / 4});
        fixture.without_noise().config.physics.time_step = time_step;
        fixture.config.physics.drive = drive;
        fixture.config.robot.bumper = bumper;
        const Scene scene = fixture.scene();
        World world(scene, starts_of(scene));
        world.set_rim_speeds(0, kTopSpeed, kTopSpeed);
        run(world, 3, time_step);
        // Each wall holds it by its normal force N, and the other way by up to side_friction N: all of it against what
        // is still on its way in. How far beyond the least depth it came to a halt, friction holds it.
        const bool sprung = bumper == SWE_BUMPER_SPRUNG;
        const double share = traction_limit(scene) * std::sqrt(0.5) / scene.robot.bumper_stiffness;  // of each wall [m]
        const double least = sprung ? share / (1 + scene.physics.side_friction) : 0;
        const double most = sprung ? share / (1 - scene.physics.side_friction) : 0;
        const double error = sprung ? kPressError * scene.robot.bumper_travel : 1e-4;
        for (const double depth : {world.robot_pose(0).x - 0.465, -world.robot_pose(0).y - 0.465}) {
            CHECK(depth > least - error);
            CHECK(depth < most + error);
        }
        CHECK(world.extremes().penetration < deepest);
        CHECK(world.unsolved_steps() == 0);
    };
    for (const int bumper : {SWE_BUMPER_SPRUNG, SWE_BUMPER_RIGID})
        for (const double time_step : {0.005, 0.02, 0.05})
            end_of_drive(SWE_DRIVE_DRIVEN_CONTACTS, bumper, time_step, 1e-4);
    end_of_drive(SWE_DRIVE_ARTICULATED, SWE_BUMPER_SPRUNG, 0.004, 1e-3);
}

TEST_CASE("a robot between wall and box touches both and harms neither") {
    for (const double time_step : {0.005, 0.02, 0.05}) {
        Fixture fixture({0.35, 0.2, 0});
        fixture.box_at(0.16, 0.2).without_noise().config.physics.time_step = time_step;
        const Scene scene = fixture.scene();
        World world(scene, starts_of(scene));
        world.set_rim_speeds(0, kTopSpeed, kTopSpeed);
        run(world, 2, time_step);
        world.set_rim_speeds(0, -kTopSpeed, -kTopSpeed);
        run(world, 4, time_step);
        // One robot does not move the box. Its rear is at the box's east face, the bumper pressed in.
        CHECK(std::abs(world.movable_pose(0).x - 0.16) < 1e-4);
        const double depth = traction_limit(scene) / scene.robot.bumper_stiffness;
        CHECK(std::abs(world.robot_pose(0).x - (0.16 + 0.1375 + 0.035 - depth)) <
              kPressError * scene.robot.bumper_travel);
        CHECK(world.extremes().penetration < 1e-3);
    }
}

TEST_CASE("with wheels still, energy never grows and everything stays where it is") {
    for (const double time_step : {0.005, 0.02, 0.05}) {
        const Fixture fixture;
        swe_scene_config config = fixture.config;
        config.physics.time_step = time_step;
        const Scene scene(config);
        World world(scene, starts_of(scene));
        const double energy = world.energy();
        for (int i = 0; i < 500; ++i) {
            world.step();
            REQUIRE(world.energy() <= energy + kContactEnergy);
        }
        for (unsigned i = 0; i < scene.robots; ++i)
            CHECK(std::hypot(world.robot_pose(i).x - scene.start_poses[i].x,
                             world.robot_pose(i).y - scene.start_poses[i].y) < 1e-4);
        CHECK(world.movable_pose(0).y == doctest::Approx(0.345).epsilon(1e-6));
    }
}

TEST_CASE("robots brake to a halt and their energy never grows on the way") {
    Fixture fixture;
    fixture.config.physics.time_step = 0.02;
    const Scene scene = fixture.scene();
    World world(scene, starts_of(scene));
    for (unsigned i = 0; i < scene.robots; ++i) world.set_rim_speeds(i, -kTopSpeed, -kTopSpeed);
    run(world, 3, 0.02);
    for (unsigned i = 0; i < scene.robots; ++i) world.set_rim_speeds(i, 0, 0);
    double energy = world.energy();
    CHECK(energy > 1e-3);
    for (int i = 0; i < 200; ++i) {
        world.step();
        REQUIRE(world.energy() <= energy + kContactEnergy);
        energy = std::min(energy, world.energy());
    }
    CHECK(energy < kContactEnergy);
}

TEST_CASE("energy never grows once the wheels stand still, after 1,000 random drives") {
    const Fixture fixture;
    const Scene scene = fixture.scene();
    const double time_step = scene.physics.time_step;
    const auto random_speed = [](std::uint32_t word) { return kTopSpeed * symmetric(word); };
    double largest_growth = 0;
    for (std::uint32_t drive = 0; drive < 1000; drive += kStride) {
        World world(scene, starts_of(scene));
        for (std::uint32_t turn = 0; turn < 6; ++turn) {
            for (unsigned robot = 0; robot < scene.robots; ++robot) {
                const auto words = draw({7, 0, drive, 0}, Purpose::wheels, robot, turn);
                world.set_rim_speeds(robot, random_speed(words[0]), random_speed(words[1]));
            }
            run(world, 2, time_step);
        }
        for (unsigned robot = 0; robot < scene.robots; ++robot) world.set_rim_speeds(robot, 0, 0);
        double energy = world.energy();
        for (int i = 0; i < 20; ++i) {
            world.step();
            largest_growth = std::max(largest_growth, world.energy() - energy);
            energy = world.energy();
        }
        // Wheels that stand still hold against bumpers that stay pressed in. All else is at rest.
        CHECK(std::abs(energy - bumper_energy(world, scene)) < kContactEnergy);
    }
    CHECK(largest_growth < kStickEnergy);
}

TEST_CASE("the same world gives the same bits, another start other bits") {
    const Fixture fixture;
    const Scene scene = fixture.scene();
    const auto hash_of_run = [&](double nudge) {
        std::vector<Pose> starts = scene.start_poses;
        starts[0].x += nudge;
        World world(scene, starts_of(scene, starts));
        for (unsigned i = 0; i < scene.robots; ++i) world.set_rim_speeds(i, 0.1, -0.05);
        run(world, 5, 0.02);
        return world.fold_state(1);
    };
    CHECK(hash_of_run(0) == hash_of_run(0));
    CHECK(hash_of_run(0) != hash_of_run(1e-12));
}

TEST_CASE("the force on the box is that of the wheels") {
    Fixture fixture(Fixture::aligned(1));
    fixture.box_at(0, 0.2).without_noise().config.sensors.touch_mode = SWE_TOUCH_MODE_FORCE;
    const Scene scene = fixture.scene();
    World world(scene, starts_of(scene));
    CHECK(world.push_force(0, 0) == 0);
    world.set_rim_speeds(0, kTopSpeed, kTopSpeed);
    run(world, 5, 0.02);
    CHECK(world.push_force(0, 0) == doctest::Approx(traction_limit(scene)).scale(0).epsilon(0.01));
    world.set_rim_speeds(0, -kTopSpeed, -kTopSpeed);
    run(world, 1, 0.02);
    CHECK(world.push_force(0, 0) == 0);
}

TEST_CASE("an assertion of ODE becomes an error") {
    CHECK_THROWS_AS(provoke_ode_assertion(), Error);
    CHECK_THROWS_WITH(provoke_ode_assertion(), doctest::Contains("bad world argument"));
    const Fixture fixture;  // and others go on
    const Scene scene = fixture.scene();
    World world(scene, starts_of(scene));
    run(world, 1, 0.02);
}

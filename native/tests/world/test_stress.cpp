// SPDX-License-Identifier: BSD-3-Clause
// A box or a cylinder is thrown and spun at walls, corners and robots: all stay inside and on the floor, lose energy,
// come to rest.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "bumpers.hpp"
#include "fixture.hpp"
#include "world/world.hpp"

using namespace swarmevo;

namespace {

constexpr double kFastest = 10, kFastestSpin = 10;  // bounds of box.velocity [m/s], [rad/s]
constexpr double kDeepest = 1e-3, kHighest = 1e-3;  // overlap and lift [m]
constexpr double kLeastUpright = 0.998;             // cosine of 3.6 degrees
constexpr double kContactEnergy = 1e-7;             // a box at 10 m/s has 12 J
// What friction may give back where it sticks, like a spring [J]: a robot that is held by all of its friction, 0.8 N,
// has moved by kStickSlip for a step of 50 ms until that is so.
constexpr double kStickEnergy = 8e-6;
constexpr double kStill = 1e-5;  // way in the last second [m]
// The centre of mass of an articulated robot is below its axle: between its casters it swings for ever, as nothing
// brakes that. A degree, until a caster touches, is a third of a millimetre.
constexpr double kSwing = 5e-4;
constexpr double kDiameter = 0.18;  // of the cylinder: the box's short side [m]

struct Throw {
    std::string name;
    Pose box;
    double speed, direction;     // [m/s], [rad]
    std::vector<double> robots;  // poses
};

const std::vector<double> kOutOfTheWay = {-0.45, -0.45, 0};

std::vector<Throw> throws(double speed) {
    constexpr double north = kPi / 2, north_east = kPi / 4;
    return {
        {"at a wall", {0, 0, 0}, speed, north, kOutOfTheWay},
        {"at a wall, askew", {0, 0, 0.3}, speed, 0.64, kOutOfTheWay},
        {"along a wall", {-0.3, 0.4, 0}, speed, 0, kOutOfTheWay},
        {"away from a wall", {0, 0.41, 0}, speed, -north, kOutOfTheWay},
        {"into a corner", {0, 0, 0}, speed, north_east, kOutOfTheWay},
        {"into a corner, edge first", {0, 0, north_east}, speed, north_east, kOutOfTheWay},
        {"at a robot", {0, 0, 0}, speed, north, {0.05, 0.3, 0}},
        {"at a robot at a wall", {0, 0, 0}, speed, north, {0.03, 0.4649, 0}},
        {"at a robot in a corner", {0, 0, 0}, speed, north_east, {0.4649, 0.4649, 0}},
        {"at a row", {0, 0, 0}, speed, north, {-0.1, 0.3, 0, 0, 0.3, 1, 0.1, 0.3, 2}},
        {"at a queue", {0, -0.2, 0}, speed, north, {0, 0, 0, 0, 0.08, 1, 0, 0.2, 2}},
        {"at a tight queue", {0, 0, 0}, speed, north, {0, 0.2, 0, 0, 0.271, 1}},
        {"into a crowd", {0, 0, 0.5}, speed, 0.7, {0.3, 0.1, 0, 0.3, 0.2, 1, 0.2, 0.3, 2, 0.1, 0.3, 3, 0.38, 0.3, 4}},
    };
}

// How far what does not give way of a body reaches out of the arena [m]; negative inside.
double beyond(const Scene& scene, const Pose& pose, double half_x, double half_y) {
    const double cosine = std::abs(std::cos(pose.heading)), sine = std::abs(std::sin(pose.heading));
    return std::max(std::abs(pose.x) + half_x * cosine + half_y * sine,
                    std::abs(pose.y) + half_x * sine + half_y * cosine) -
           scene.arena.bounds()[1];
}

std::vector<Pose> poses(const World& world, const Scene& scene) {
    std::vector<Pose> all = {world.movable_pose(0)};
    for (unsigned robot = 0; robot < scene.robots; ++robot) all.push_back(world.robot_pose(robot));
    return all;
}

double beyond(const World& world, const Scene& scene) {
    const Pose thrown = world.movable_pose(0);
    const swe_movable_config& config = scene.movables[0].config;
    const double half_x = config.size[0] / 2, half_y = config.size[1] / 2;
    double most = config.shape == SWE_SHAPE_CYLINDER ? beyond(scene, {thrown.x, thrown.y, 0}, half_x, half_y)
                                                     : beyond(scene, thrown, half_x, half_y);
    const double rigid = scene.robot.radius - (scene.robot.bumper == SWE_BUMPER_SPRUNG ? scene.robot.bumper_travel : 0);
    for (unsigned robot = 0; robot < scene.robots; ++robot) {
        const Pose pose = world.robot_pose(robot);
        most = std::max(most, beyond(scene, {pose.x, pose.y, 0}, rigid, rigid));
    }
    return most;
}

void check_throw(const Throw& thrown, double spin, std::int32_t shape, double time_step,
                 std::int32_t drive = SWE_DRIVE_DRIVEN_CONTACTS) {
    const bool is_level = drive == SWE_DRIVE_DRIVEN_CONTACTS;
    INFO((shape == SWE_SHAPE_BOX ? "box " : "cylinder "), thrown.name, ", ", thrown.speed, " m/s, ", spin,
         " rad/s, step ", time_step, " s", (is_level ? "" : ", articulated"));
    Fixture fixture(thrown.robots);
    fixture.without_noise().box_at(thrown.box.x, thrown.box.y, thrown.box.heading);
    fixture.config.physics.time_step = time_step;
    fixture.config.physics.drive = drive;
    fixture.config.movables[0].shape = shape;
    if (shape == SWE_SHAPE_CYLINDER) std::fill_n(fixture.config.movables[0].size, 2, kDiameter);
    const double velocity[] = {thrown.speed * std::cos(thrown.direction), thrown.speed * std::sin(thrown.direction),
                               spin};
    std::copy_n(velocity, 3, fixture.config.movables[0].velocity);
    const Scene scene = fixture.scene();
    World world(scene, starts_of(scene));

    double energy = world.energy(), gain = 0, farthest = -1;
    const auto run = [&](double seconds) {
        for (long i = 0; i < std::lround(seconds / time_step); ++i) {
            world.step();
            gain = std::max(gain, world.energy() - energy);
            energy = std::min(energy, world.energy());
            farthest = std::max(farthest, beyond(world, scene));
        }
    };
    run(4);
    const std::vector<Pose> before = poses(world, scene);
    run(1);
    const std::vector<Pose> after = poses(world, scene);
    for (std::size_t i = 0; i < after.size(); ++i)
        CHECK(std::hypot(after[i].x - before[i].x, after[i].y - before[i].y) < (is_level || i == 0 ? kStill : kSwing));
    // Wheels that stand still hold against bumpers that stay pressed in.
    if (is_level) CHECK(std::abs(world.energy() - bumper_energy(world, scene)) < kContactEnergy);
    CHECK(gain < kStickEnergy);
    CHECK(farthest < kDeepest);
    CHECK(world.extremes().penetration < kDeepest);
    CHECK(world.extremes().lift < kHighest);
    CHECK(world.extremes().upright > kLeastUpright);
    CHECK(world.unsolved_steps() == 0);
}

void check_throws(std::int32_t shape, double speed) {
    for (const double time_step : {0.005, 0.02, 0.05})
        for (const double spin : {0.0, -kFastestSpin, kFastestSpin})
            for (const Throw& thrown : throws(speed)) check_throw(thrown, spin, shape, time_step);
}

}  // namespace

TEST_CASE("a box that is thrown, up to as fast as the config allows, harms nothing") {
    for (const double speed : {0.0, 0.1, 0.5, 1.0, 2.0, 5.0, kFastest}) check_throws(SWE_SHAPE_BOX, speed);
}

TEST_CASE("a cylinder that is thrown harms nothing") {
    for (const double speed : {0.5, 2.0, kFastest}) check_throws(SWE_SHAPE_CYLINDER, speed);
}

TEST_CASE("what is thrown at articulated robots harms nothing") {
    for (const std::int32_t shape : {SWE_SHAPE_BOX, SWE_SHAPE_CYLINDER})
        for (const double speed : {1.0, kFastest}) {
            const std::vector<Throw> all = throws(speed);
            for (std::size_t i = 0; i < all.size(); i += kStride)
                check_throw(all[i], kFastestSpin, shape, 0.004, SWE_DRIVE_ARTICULATED);
        }
}

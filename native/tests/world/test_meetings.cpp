// SPDX-License-Identifier: BSD-3-Clause
// Robots that meet the box, walls and each other end where the reference has them end.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "fixture.hpp"
#include "planar_twin.hpp"

using namespace swarmevo;

namespace {

constexpr double kTopSpeed = 6.28 * 0.0205;  // [m/s]
constexpr double kNorth = kPi / 2, kRadius = 0.035, kHalfWidth = 0.09, kHalfLength = 0.1375;
constexpr double kSpacing = 0.0715;  // of robots side by side [m]

struct Start {
    double x, y, heading;
    double drive = 1;  // share of the top speed of both wheels
};

struct Meeting {
    std::string name;
    std::vector<Start> robots;
    double seconds;
    bool has_box = false;  // in the middle of a wide arena; else it is out of the way
};

// Errors that are let pass.
struct Bounds {
    double way;           // share of the longest way
    double heading;       // of robots [rad]
    double turn, a_turn;  // of the box: share, and at least [rad]
};
constexpr double kDegree = kRadiansPerDegree;
constexpr Bounds kUsual = {0.02, 2 * kDegree, 0.05, 0.5 * kDegree};

// Side by side before the middle of the long face, moved along it by `off`.
std::vector<Start> row(int n, double off, double gap) {
    std::vector<Start> robots;
    for (int i = 0; i < n; ++i)
        robots.push_back({off + kSpacing * (i - (n - 1) / 2.0), -kHalfWidth - kRadius - gap, kNorth});
    return robots;
}

template <typename Either>
void drive(Either& world, const Meeting& meeting) {
    for (unsigned i = 0; i < meeting.robots.size(); ++i) {
        const double speed = meeting.robots[i].drive * kTopSpeed;
        world.set_rim_speeds(i, speed, speed);
    }
}

// Robots' poses, and then the box's.
template <typename Either>
std::vector<Pose> poses(const Either& world, const Meeting& meeting) {
    std::vector<Pose> all;
    for (unsigned i = 0; i < meeting.robots.size(); ++i) all.push_back(world.robot_pose(i));
    all.push_back(world.movable_pose(0));
    return all;
}

double apart(const Pose& a, const Pose& b) {
    return std::hypot(a.x - b.x, a.y - b.y);
}

double turned(const Pose& a, const Pose& b) {
    return std::abs(std::remainder(a.heading - b.heading, 2 * kPi));
}

void check(const Meeting& meeting, std::initializer_list<double> time_steps, const Bounds& bounds = kUsual) {
    std::vector<double> starts;
    for (const Start& s : meeting.robots) starts.insert(starts.end(), {s.x, s.y, s.heading});
    Fixture fixture(starts);
    fixture.without_noise();
    if (meeting.has_box) {
        fixture.box_at(0, 0).arena_of(3);
    } else {
        fixture.box_at(0.35, 0.38);
    }
    const Pose box = {fixture.config.movables[0].pose[0], fixture.config.movables[0].pose[1],
                      fixture.config.movables[0].pose[2]};
    const Scene described = fixture.scene();
    PlanarTwin twin(described);
    drive(twin, meeting);
    twin.run(meeting.seconds);
    const std::vector<Pose> there = poses(twin, meeting);
    std::vector<Pose> before = described.start_poses;
    before.push_back(box);
    double longest = 0;
    for (std::size_t i = 0; i < there.size(); ++i) longest = std::max(longest, apart(there[i], before[i]));
    CHECK(longest > 0.05);

    for (const double time_step : time_steps) {
        INFO(meeting.name, ", step ", time_step, " s");
        fixture.config.physics.time_step = time_step;
        const Scene scene = fixture.scene();
        World world(scene, starts_of(scene));
        drive(world, meeting);
        run(world, meeting.seconds, time_step);
        const std::vector<Pose> here = poses(world, meeting);
        for (std::size_t i = 0; i < here.size(); ++i) {
            CAPTURE(i);
            CHECK(apart(here[i], there[i]) < bounds.way * longest);
            const bool is_box = i + 1 == here.size();
            CHECK(turned(here[i], there[i]) <
                  (is_box ? std::max(bounds.turn * turned(there[i], before[i]), bounds.a_turn) : bounds.heading));
        }
        CHECK(world.unsolved_steps() == 0);
    }
}

}  // namespace

TEST_CASE("three that push beside the middle move and turn the box as the reference's do") {
    for (const double off : {0.0, 0.01, 0.02, 0.03, 0.06})
        check({"three, " + std::to_string(1000 * off) + " mm off the middle", row(3, off, 1e-4), 1.6, true},
              {0.005, 0.02, 0.05});
}

TEST_CASE("the box leaves its place as the reference's does, pushed from 0.1 mm before it") {
    for (const int n : {3, 4}) check({std::to_string(n) + " in a row", row(n, 0, 1e-4), 1, true}, {0.005, 0.02, 0.05});
}

TEST_CASE("one that presses from the side hinders three that push as much as the reference's does") {
    std::vector<Start> robots = row(3, 0, 1e-4);
    robots.push_back({-kHalfLength - kRadius - 0.001, 0, 0});
    check({"three push, one presses", robots, 2, true}, {0.005, 0.02, 0.05});
}

TEST_CASE("one that is wedged at a corner moves as the reference's does") {
    std::vector<Start> robots = {{-kHalfLength - 0.02, -kHalfWidth - 0.03, kPi / 4}};
    for (const Start& one : row(3, 0, 1e-4)) robots.push_back(one);
    check({"three push, one slantwise at a corner", robots, 1.5, true}, {0.005, 0.02, 0.05});
}

TEST_CASE("robots that glance off each other go where the reference's go") {
    for (const double off : {0.02, 0.04, 0.06})
        check({"glancing by " + std::to_string(1000 * off) + " mm", {{-0.12, 0, 0}, {0, off, kPi}}, 1.5},
              {0.005, 0.02, 0.05});
}

TEST_CASE("a robot that runs into another's side goes on with it as the reference's does") {
    // They turn to and fro against each other for as long as they drive: a step that damped that would be found out.
    check({"into each other's side", {{-0.12, 0, 0}, {0, -0.12, kNorth}}, 2}, {0.005, 0.02, 0.05});
    check({"into the side of one that is parked", {{-0.15, 0, 0}, {0, -0.03, kNorth, 0}}, 2}, {0.005, 0.02, 0.05});
}

TEST_CASE("a robot that runs into a slower one from behind goes on with it as the reference's does") {
    for (const double off : {0.0, 0.01})
        check({"from behind, " + std::to_string(1000 * off) + " mm off", {{-0.12, off, 0}, {-0.03, 0, 0, 0.4}}, 2},
              {0.005, 0.02, 0.05});
}

TEST_CASE("a robot that meets a wall askew slides along it as the reference's does") {
    for (const double angle : {20.0, 45.0, 70.0})
        check({"a wall at " + std::to_string(angle) + " degrees", {{0.38, -0.2, angle * kDegree}}, 2},
              {0.005, 0.02, 0.05});
}

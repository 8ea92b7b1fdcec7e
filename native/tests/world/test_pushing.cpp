// SPDX-License-Identifier: BSD-3-Clause
// The paper's claim that the box takes three: wherever one or two robots push it, it stays.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "fixture.hpp"
#include "world/limit_curve.hpp"
#include "world/world.hpp"

using namespace swarmevo;

namespace {

constexpr double kTopSpeed = 6.28 * 0.0205;  // [m/s]
constexpr double kSpacing = 0.071;           // of two robots side by side [m]
constexpr double kGrid = 0.01;               // of the places that are tried [m]
constexpr double kStill = 1e-4;              // way of a box that did not move [m]

// A face of the box: pushed to the north on the long one, to the east on the short one.
struct Face {
    bool is_long;
    double half_length, half_depth;  // [m]
};

Face face(bool is_long) {
    return is_long ? Face{true, 0.1375, 0.09} : Face{false, 0.09, 0.1375};
}

// Places of robots along a face, each a list of their centres [m]: every kGrid from one end to the other, and the ends.
std::vector<std::vector<double>> places(const Face& face, int robots) {
    const double room = face.half_length - kSpacing * (robots - 1) / 2;  // for their middle
    std::vector<std::vector<double>> all;
    for (double middle = -room; middle < room + kGrid; middle += kGrid) {
        std::vector<double> places;
        for (int i = 0; i < robots; ++i) places.push_back(std::min(middle, room) + kSpacing * (i - (robots - 1) / 2.0));
        all.push_back(places);
    }
    return all;
}

// How far the box, in the middle of a wide arena, is moved by robots that push it for 20 s [m], over what its turning
// moves its corners.
double pushed(const Face& face, const std::vector<double>& at, double box_friction) {
    constexpr double gap = 5e-4, slow = 0.02;
    std::vector<double> poses;
    for (const double along : at) {
        const double before = -face.half_depth - 0.035 - gap;
        if (face.is_long)
            poses.insert(poses.end(), {along, before, kPi / 2});
        else
            poses.insert(poses.end(), {before, along, 0});
    }
    Fixture fixture(poses);
    fixture.without_noise().box_at(0, 0).arena_of(3);
    fixture.config.movables[0].friction = box_friction;
    const Scene scene = fixture.scene();
    World world(scene, starts_of(scene));
    // Slowly until they press as hard as they can: a blow, and be it of bumpers, would add to what they push with.
    for (const auto& [share, seconds] : {std::pair{slow, 4.0}, std::pair{1.0, 16.0}}) {
        for (unsigned i = 0; i < scene.robots; ++i) world.set_rim_speeds(i, share * kTopSpeed, share * kTopSpeed);
        run(world, seconds, scene.physics.time_step);
    }
    for (unsigned i = 0; i < scene.robots; ++i) {
        const Pose robot = world.robot_pose(i);
        CHECK((face.is_long ? robot.y : robot.x) > -face.half_depth - scene.robot.radius);  // it does lean on it
    }
    const Pose box = world.movable_pose(0);
    return std::hypot(box.x, box.y) + std::abs(box.heading) * std::hypot(face.half_length, face.half_depth);
}

// Does the limit curve hold the box against robots that push as hard as their wheels can?
bool holds(const Face& face, const std::vector<double>& at, double box_friction) {
    const Scene scene = Fixture().scene();
    const double force = traction_limit(scene);
    Load load{};
    for (const double along : at) {
        (face.is_long ? load.y : load.x) += force;
        load.torque += (face.is_long ? 1 : -1) * along * force;
    }
    const double x = scene.movables[0].config.size[0] / 2, y = scene.movables[0].config.size[1] / 2;
    const Feet feet = {Vector{-x, -y, 0}, Vector{x, -y, 0}, Vector{-x, y, 0}, Vector{x, y, 0}};
    return hold_of(feet, box_friction * scene.movables[0].config.mass * scene.physics.gravity / 4, load, 1e-4).factor >=
           1;
}

}  // namespace

TEST_CASE("by pushing, one and two robots never move the box wherever they stand") {
    const double friction = Fixture().config.movables[0].friction;
    CHECK(friction == 0.62);
    for (const bool is_long : {true, false})
        for (const int robots : {1, 2})
            for (const auto& at : places(face(is_long), robots)) {
                CAPTURE(is_long);
                CAPTURE(robots);
                CAPTURE(at[0]);
                CHECK(holds(face(is_long), at, friction));
                CHECK(pushed(face(is_long), at, friction) < kStill);
            }
}

TEST_CASE("two robots at an end of the long face move a box of a little less friction, just where feet give way") {
    constexpr double kFriction = 0.575;
    const Face face = ::face(true);
    for (const auto& at : places(face, 2)) {
        CAPTURE(at[0]);
        const bool stays = holds(face, at, kFriction);
        CHECK((pushed(face, at, kFriction) < kStill) == stays);
    }
    CHECK_FALSE(holds(face, places(face, 2).front(), kFriction));
    CHECK_FALSE(holds(face, places(face, 2).back(), kFriction));
}

TEST_CASE("by pushing, three robots move the box") {
    for (const auto& at :
         {std::vector{-kSpacing, 0.0, kSpacing}, std::vector{0.1375 - 2 * kSpacing, 0.1375 - kSpacing, 0.1375}})
        CHECK(pushed(face(true), at, 0.62) > 0.05);
}

// SPDX-License-Identifier: BSD-3-Clause
// What makes a step cheap may change how it is solved for, not what happens.
#include <doctest/doctest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "fixture.hpp"
#include "world/assume/list.hpp"
#include "world/step.hpp"

using namespace swarmevo;

namespace {

constexpr std::size_t kAssumptions = 10;  // of level bodies
constexpr double kSeconds = 4;
constexpr double kNear = 2e-3;  // [m]; of ways of about 20 cm

// Where robots and box are in the end.
std::vector<Pose> ends(std::vector<double> starts, bool box_at_wall, std::size_t without) {
    Fixture fixture(std::move(starts));
    fixture.without_noise().box_at(0, box_at_wall ? 0.41 : 0.2);
    const Scene scene = fixture.scene();
    State state(scene, starts_of(scene));
    Assumptions all = all_assumptions(state);
    REQUIRE(all.size() == kAssumptions);
    if (without < kAssumptions) all.erase(all.begin() + static_cast<std::ptrdiff_t>(without));
    Stepper stepper(state, std::move(all));
    for (unsigned robot = 0; robot < scene.robots; ++robot) state.set_rim_speeds(robot, 0.06, 0.06);
    for (long i = 0; i < std::lround(kSeconds / scene.physics.time_step); ++i) stepper.advance();
    std::vector<Pose> poses = {pose_of(state.movables[0].body())};
    for (const Robot& robot : state.robots) poses.push_back(pose_of(robot.drive->body()));
    return poses;
}

}  // namespace

TEST_CASE("a world without one of its assumptions comes out the same") {
    const std::vector<double> row = {-0.08, 0, kPi / 2, 0, 0, kPi / 2, 0.08, 0, kPi / 2};
    for (const bool box_at_wall : {false, true}) {
        const std::vector<Pose> expected = ends(row, box_at_wall, kAssumptions);
        for (std::size_t without = 0; without < kAssumptions; ++without) {
            CAPTURE(box_at_wall);
            CAPTURE(without);
            const std::vector<Pose> found = ends(row, box_at_wall, without);
            for (std::size_t i = 0; i < found.size(); ++i) {
                CHECK(std::abs(found[i].x - expected[i].x) < kNear);
                CHECK(std::abs(found[i].y - expected[i].y) < kNear);
            }
        }
    }
}

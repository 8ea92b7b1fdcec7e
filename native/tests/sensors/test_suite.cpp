// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <vector>

#include "fixture.hpp"
#include "sensors/infrared.hpp"
#include "sensors/rf.hpp"
#include "sensors/touch.hpp"

using namespace swarmevo;

namespace {

constexpr EpisodeKey kKey = {1, 0, 0, 0};

std::vector<double> observe(const Scene& scene) {
    const Snapshot now{{{0.45, 0.2, 0.5}}, {{0.35, 0.3, 0.2}}, {}};
    std::vector<double> observation(scene.suite.size());
    scene.suite.sense({scene, now, kKey, 0, 0}, observation.data());
    return observation;
}

}  // namespace

TEST_CASE("the paper's robot observes 13 numbers") {
    const Scene scene = Fixture().scene();
    CHECK(scene.suite.size() == 13);
    CHECK(scene.suite.place_of(SWE_SENSOR_INFRARED) == 0);
    CHECK(scene.suite.place_of(SWE_SENSOR_TOUCH) == 8);
    CHECK(scene.suite.place_of(SWE_SENSOR_RF) == 12);
    CHECK(scene.suite.place_of(99) == -1);
    CHECK(scene.commands == 2);
}

TEST_CASE("an observation has the readings of the list in its order, each as without the others") {
    Fixture fixture;
    const std::vector<double> all = observe(fixture.scene());
    CHECK(all[2] > 0);   // a wall to its right
    CHECK(all[12] > 0);  // and the emitter near
    const std::vector<double> turned = observe(fixture.sense({SWE_SENSOR_RF, SWE_SENSOR_INFRARED}).scene());
    REQUIRE(turned.size() == 9);
    CHECK(turned[0] == all[12]);
    CHECK(std::vector<double>(turned.begin() + 1, turned.end()) == std::vector<double>(all.begin(), all.begin() + 8));
}

TEST_CASE("a robot without sensors observes nothing") {
    Fixture fixture;
    const Scene scene = fixture.sense({}).scene();
    CHECK(scene.suite.size() == 0);
    CHECK(observe(scene).empty());
}

TEST_CASE("any number of rays and of touch sensors") {
    Fixture fixture;
    std::fill_n(fixture.config.sensors.infrared_yaw_deg, SWE_MAX_INFRARED, -17.2);
    fixture.config.sensors.infrared_count = SWE_MAX_INFRARED;
    fixture.config.sensors.touch_count = 1;
    const Scene scene = fixture.scene();
    CHECK(scene.suite.size() == SWE_MAX_INFRARED + 2);
    CHECK(scene.suite.place_of(SWE_SENSOR_TOUCH) == SWE_MAX_INFRARED);
}

TEST_CASE("a list that cannot be is refused") {
    Fixture fixture;
    CHECK_THROWS_WITH(fixture.sense({1, 99}).scene(), doctest::Contains("robot.sensors[1]: not set, or not one"));
    CHECK_THROWS_WITH(fixture.sense({3, 1, 3}).scene(), doctest::Contains("robot.sensors[2]: expected each device"));
    fixture.config.robot.sensor_count = SWE_MAX_DEVICES + 1;
    CHECK_THROWS_WITH(fixture.scene(), doctest::Contains("robot.sensors: expected 0 to 16 devices, got 17"));
    fixture.sense({1}).config.sensors.infrared_count = 0;
    CHECK_THROWS_WITH(fixture.scene(), doctest::Contains("sensors.infrared_yaw_deg: expected 1 to 64 rays, got 0"));
    fixture.config.sensors.infrared_count = 2;
    fixture.config.sensors.infrared_yaw_deg[1] = NAN;
    CHECK_THROWS_WITH(fixture.scene(), doctest::Contains("sensors.infrared_yaw_deg[1]"));
}

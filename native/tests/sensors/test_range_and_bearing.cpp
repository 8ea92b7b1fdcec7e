// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <vector>

#include "fixture.hpp"
#include "sensors/range_and_bearing.hpp"
#include "sensors/sectors.hpp"

using namespace swarmevo;

TEST_CASE("a sector is centred at its bearing, and begins on its right") {
    for (const unsigned n : {1u, 2u, 4u, 5u, 32u})
        for (unsigned sector = 0; sector < n; ++sector)
            for (const double turns : {-7.0, 0.0, 3.0}) {
                const double width = 2 * kPi / n, centre = sector * width + turns * 2 * kPi;
                CHECK(sector_of(centre, n) == sector);
                CHECK(sector_of(centre - 0.499 * width, n) == sector);
                CHECK(sector_of(centre + 0.499 * width, n) == sector);
            }
    CHECK(sector_of(kPi, 2) == 1);
}

TEST_CASE("each sector has its nearest robot alone, and its message") {
    Fixture fixture;
    fixture.sense({SWE_SENSOR_RANGE_AND_BEARING}).config.sensors.range_and_bearing_message = 2;
    const Scene scene = fixture.scene();
    CHECK(scene.suite.size() == 4 * 3);
    CHECK(scene.commands == 4);
    Snapshot now;
    now.robots = {{0, 0, kPi / 2}, {0, 0.35, 0}, {0, 0.07, 0}, {0.14, 0, 0}, {0, -0.71, 0}};
    now.messages = {0, 0, 1, 1, 0, 1, 1, 0, 1, 1};
    std::vector<double> readings(12);
    scene.suite.sense({scene, now, {1, 0, 0, 0}, 0, 0}, readings.data());
    const double expected[] = {0.9, 0, 1, 0, 0, 0, 0, 0, 0, 0.8, 1, 0};  // ahead, left, behind, right
    for (int i = 0; i < 12; ++i) CHECK(readings[i] == doctest::Approx(expected[i]));
}

TEST_CASE("robots at the same place perceive each other at distance 0") {
    Fixture fixture;
    const Scene scene = fixture.sense({SWE_SENSOR_RANGE_AND_BEARING}).scene();
    Snapshot now;
    now.robots = {{0.1, 0.1, 0}, {0.1, 0.1, 0}};
    std::vector<double> readings(4);
    scene.suite.sense({scene, now, {1, 0, 0, 0}, 0, 0}, readings.data());
    CHECK(readings[0] == 1);
}

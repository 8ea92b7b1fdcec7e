// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "fixture.hpp"
#include "sensors/rf.hpp"

using namespace swarmevo;

namespace {

constexpr EpisodeKey kKey = {1, 0, 0, 0};

constexpr unsigned kRandomScenes = 10000;

double strength(const Scene& scene, const Pose& robot) {
    const Snapshot now{{robot}, {}, {}};
    return signal_strength({scene, now, kKey, 0, 0});
}

}  // namespace

TEST_CASE("RF agrees with its definition") {
    const Fixture fixture;
    const Scene scene = fixture.scene();
    unsigned heard = 0;
    for (unsigned number = 0; number < kRandomScenes; ++number) {
        const auto w = draw({95, 0, number, 0}, Purpose::start, 0, 0);
        const Pose robot = {0.46 * symmetric(w[0]), 0.46 * symmetric(w[1]), 0};
        const double r = std::sqrt(std::pow(robot.x - 0, 2) + std::pow(robot.y - 0.345, 2) + std::pow(0.05 - 0.03, 2));
        const double expected = r <= 0.3 ? std::clamp(std::pow(r, -2), 1.0, 50.0) : 1;
        heard += expected > 1;
        REQUIRE(strength(scene, robot) == doctest::Approx(expected).epsilon(1e-12));
        REQUIRE(in_emitter_range(scene, {{robot}, {}, {}}, 0) == (r <= 0.3));
    }
    CHECK(heard > kRandomScenes / 10);
}

TEST_CASE("RF strength is 1 / r^2 within its limits, and silent beyond its range unless the whole arena hears it") {
    Fixture fixture;
    const auto strength_at = [&](double distance) {
        const Scene scene = fixture.scene();
        return strength(scene, {0, 0.345 - distance, 0});
    };
    const double dz = 0.05 - 0.03;
    CHECK(strength_at(0.2) == doctest::Approx(1 / (0.04 + dz * dz)));
    CHECK(strength_at(0) == 50);
    CHECK(strength_at(0.31) == 1);
    fixture.config.emitters[0].reach = SWE_REACH_ARENA;
    CHECK(strength_at(0.5) == doctest::Approx(1 / (0.25 + dz * dz)));
    CHECK(in_emitter_range(fixture.scene(), {{{0, 0.05, 0}}, {}, {}}, 0));
    CHECK_FALSE(in_emitter_range(fixture.scene(), {{{0, 0.04, 0}}, {}, {}}, 0));
}

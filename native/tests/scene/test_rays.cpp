// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "fixture.hpp"
#include "scene/figure.hpp"

using namespace swarmevo;

TEST_CASE("rays in odd places") {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    CHECK(ray_to_disc(0, 0, 1, 0, 0.5, 0, 1) == 0);                                                    // starts inside
    CHECK(ray_to_disc(0, 0, 1, 0, -2, 0, 1) == infinity);                                              // behind
    CHECK(ray_to_disc(0, 1, 1, 0, 3, 0, 1) == doctest::Approx(3));                                     // tangent
    CHECK(ray_to_rectangle(0, 0, 1, 0, {0.2, 0, 0.3}, 1, 1) == 0);                                     // starts inside
    CHECK(ray_to_rectangle(-2, 1, 1, 0, {0, 0, 0}, 1, 1) == doctest::Approx(1));                       // along an edge
    CHECK(ray_to_rectangle(-2, 0, 1, 0, {0, 0, kPi / 4}, 1, 1) == doctest::Approx(2 - std::sqrt(2)));  // onto a corner
    CHECK(ray_to_rectangle(-2, 0, -1, 0, {0, 0, 0}, 1, 1) == infinity);                                // away
    const Arena square{Fixture().config.arena};
    CHECK(ray_to_arena(square, 0, 0, 0, 1) == doctest::Approx(0.5));
    CHECK(ray_to_arena(square, 0.49, 0.49, std::sqrt(0.5), std::sqrt(0.5)) == doctest::Approx(0.01 * std::sqrt(2)));
    CHECK(ray_to_arena(square, 0.51, 0, 1, 0) == 0);                        // pressed a little into the wall
    CHECK(ray_to_disc(0, 1.001, 1, 0, 3, 0, 1) == infinity);                // just past it
    CHECK(ray_to_disc(0, 0, 1, 0, 1, 0, 1) == 0);                           // starts on its rim
    CHECK(ray_to_rectangle(-2, 1.001, 1, 0, {0, 0, 0}, 1, 1) == infinity);  // just past an edge
    CHECK(ray_to_rectangle(-1, 0, 1, 0, {0, 0, 0}, 1, 1) == 0);             // starts on an edge
    CHECK(ray_to_rectangle(-1, 0, 0, 1, {0, 0, 0}, 1, 1) == 0);             // starts on an edge and runs along it
    CHECK(ray_to_arena(square, 0.5, 0.5, 1, 0) == 0);                       // starts in a corner
    CHECK(ray_to_arena(square, 0, 0.5, 1, 0) == doctest::Approx(0.5));      // runs along a wall
}

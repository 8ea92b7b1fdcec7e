// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <cmath>
#include <initializer_list>

#include "world_grip.hpp"

using namespace swarmevo;

TEST_CASE("a wheel that grips has its whole friction in both directions") {
    Grip grip(0.05);
    CHECK(grip.along() == 1);
    CHECK(grip.across() == 1);
    grip.note_slip(0.01, 0.01, 0.05);
    CHECK(grip.along() == 1);
    CHECK(grip.across() == 1);
}

TEST_CASE("a wheel that slips divides its friction by the direction of slip, on Coulomb's circle") {
    for (const double angle : {0.0, 0.3, 1.0, 1.5}) {
        Grip grip(0.05);
        grip.note_slip(-0.1 * std::cos(angle), 0.1 * std::sin(angle), 0.05);
        CHECK(grip.along() == doctest::Approx(std::cos(angle)));
        CHECK(grip.across() == doctest::Approx(std::sin(angle)));
    }
}

TEST_CASE("the direction of slip is smoothed over about a step") {
    Grip grip(0.05);
    grip.note_slip(0.1, 0, 0.05);
    grip.note_slip(0, 0.1, 0.05);  // turned by 90 degrees: half of it is taken over
    CHECK(grip.along() == doctest::Approx(std::sqrt(0.5)));
    grip.note_slip(0, 0.1, 0.00025);  // a blow is too short for more
    CHECK(grip.along() == doctest::Approx(std::sqrt(0.5)).epsilon(0.01));
    grip.note_slip(0, 0, 0.05);
    CHECK(grip.along() == 1);
}

TEST_CASE("a wheel that leaps to a side gets friction against it, a few times in a step") {
    Grip grip(0.05);
    CHECK(!grip.leapt(0.01, 0.2));  // it gripped: it had all
    grip.note_slip(0.1, 0, 0.05);
    CHECK(!grip.leapt(0.1, 0.02));  // slow
    CHECK(!grip.leapt(0.5, 0.15));  // hardly turned
    CHECK(grip.leapt(0, 0.2));
    CHECK(grip.across() == doctest::Approx(std::sin(std::acos(0.0) / 2)));  // half of the turn
    CHECK(grip.leapt(0, 0.2));
    CHECK(!grip.leapt(0, 0.2));  // now it is near enough
    grip.note_slip(0.1, 0, 0.05);
    grip.note_slip(0.1, 0, 0.05);
    CHECK(grip.leapt(0, 0.2));  // another step
}

// SPDX-License-Identifier: BSD-3-Clause
// How a step deals with what its assumptions find.
#include "world/step.hpp"

#include <doctest/doctest.h>

#include <functional>
#include <utility>
#include <vector>

#include "fixture.hpp"
#include "world/constants.hpp"

using namespace swarmevo;

namespace {

// Finds what it is told to, and records the lengths of the tries that it is asked about.
struct Scripted : Assumption {
    std::function<Finding(int)> find;  // by the number of the check
    std::vector<double> checked, accepted;
    double longest = 1;

    double longest_step() const override { return longest; }
    Finding check(Attempt& attempt) override {
        checked.push_back(attempt.time_step);
        return find ? find(static_cast<int>(checked.size())) : Finding{};
    }
    void accept(const Attempt& attempt) override { accepted.push_back(attempt.time_step); }
};

// One robot that drives, with two scripted assumptions and no other.
struct Driven {
    const Scene scene = Fixture({0, 0, 0}).without_noise().scene();
    State state{scene, starts_of(scene, {{0, 0, 0}})};
    Scripted *first = new Scripted, *second = new Scripted;
    Stepper stepper{state, list()};
    const double whole = scene.physics.time_step;

    Driven() { state.set_rim_speeds(0, 0.1, 0.08); }

    Assumptions list() const {
        Assumptions both;
        both.emplace_back(first);
        both.emplace_back(second);
        return both;
    }

    // Where a step takes the robot.
    double way() {
        stepper.advance();
        return pose_of(state.robots[0].drive->body()).x;
    }
};

using Lengths = std::vector<double>;

}  // namespace

TEST_CASE("a step that holds is tried once, with every assumption checked and accepted") {
    Driven driven;
    driven.stepper.advance();
    for (const Scripted* each : {driven.first, driven.second}) {
        CHECK(each->checked == Lengths{driven.whole});
        CHECK(each->accepted == Lengths{driven.whole});
    }
}

TEST_CASE("a step in which something failed is taken back, and tried again from its start") {
    Driven failing;
    failing.first->find = [](int number) { return Finding{number > 3}; };
    CHECK(failing.way() == doctest::Approx(Driven().way()));
    CHECK(failing.second->checked == Lengths(4, failing.whole));
    CHECK(failing.second->accepted == Lengths{failing.whole});
}

TEST_CASE("a step that never holds is accepted after its last try") {
    Driven hopeless;
    hopeless.first->find = [](int) { return Finding{false}; };
    CHECK(hopeless.way() == doctest::Approx(Driven().way()));
    CHECK(hopeless.first->checked == Lengths(kMostTries, hopeless.whole));
}

TEST_CASE("a step that is too long is cut once all else holds, or at once if it is far too long") {
    const auto lengths = [](double share) {
        Driven driven;
        driven.first->find = [](int number) { return Finding{number > 2}; };
        driven.second->find = [&](int number) { return Finding{true, false, number <= 3 ? share : 1}; };
        driven.stepper.advance();
        CHECK(driven.second->accepted.front() < driven.whole);
        return Lengths(driven.second->checked.begin(), driven.second->checked.begin() + 4);
    };
    const double whole = Driven().whole;
    CHECK(lengths(0.5) == Lengths{whole, whole, whole, whole / 2});
    CHECK(lengths(kUrgentCut) == Lengths{whole, whole / 4, whole / 16, whole / 64});
}

TEST_CASE("a final finding ends the checks: the step is cut, tried again or accepted by it alone") {
    for (const auto& [finding, tries] :
         {std::pair<Finding, int>{{false, true, 0.5}, 1}, {{false, true}, 1}, {{true, true}, 0}}) {
        Driven driven;
        driven.first->find = [&, f = finding](int number) { return number == 1 ? f : Finding{}; };
        driven.second->find = [](int) { return Finding{}; };
        driven.stepper.advance();
        CHECK(driven.second->accepted.front() == driven.whole * finding.share);
        CHECK(driven.first->checked.size() == driven.second->checked.size() + 1);
        CHECK(driven.second->checked.size() == driven.second->accepted.size() - 1 + tries);
    }
}

TEST_CASE("steps are equal parts of the time step, no longer than any assumption allows") {
    Driven driven;
    driven.second->longest = 0.4 * driven.whole;
    driven.stepper.advance();
    REQUIRE(driven.first->accepted.size() == 3);
    for (const double length : driven.first->accepted) CHECK(length == doctest::Approx(driven.whole / 3));
}

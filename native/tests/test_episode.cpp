// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "episode.hpp"
#include "error.hpp"
#include "fixture.hpp"

using namespace swarmevo;

namespace {

constexpr EpisodeKey kKey = {1, 2, 3, 4};

// Runs an episode with one constant command for all.
swe_outcome run(const Scene& scene, const EpisodeKey& key, double left, double right, double* homing_times,
                const Recorder& recorder = {}) {
    Episode episode(scene, key, recorder);
    std::vector<double> commands;
    for (unsigned i = 0; i < scene.robots; ++i) commands.insert(commands.end(), {left, right});
    while (!episode.done()) {
        episode.observe();
        episode.advance(commands.data());
    }
    return episode.outcome(homing_times);
}

}  // namespace

TEST_CASE("three robots in front of the box home in and push it to the wall at the time that the speed gives") {
    Fixture fixture(Fixture::aligned(3));
    fixture.box_at(0, 0.2).without_noise().config.episode.horizon = 5;
    const Scene scene = fixture.scene();
    double homing[3];
    const swe_outcome outcome = run(scene, kKey, 1, 1, homing);
    CHECK(outcome.status == SWE_OK);
    CHECK(outcome.control_steps == 50);
    CHECK(homing[1] == 0);  // they start 0.275 m from the emitter
    // 5 mm to the box, then 0.21 m less 2 mm to the wall at up to 0.129 m/s.
    CHECK(outcome.push_time == doctest::Approx(0.213 / 0.12874).epsilon(0.1));
    CHECK(outcome.box_pose[1] == doctest::Approx(0.41).epsilon(0.001));
}

TEST_CASE("an episode may end with the push, and is the beginning of the one that goes on") {
    Fixture fixture(Fixture::aligned(3));
    fixture.box_at(0, 0.2).without_noise().config.episode.horizon = 5;
    const Scene whole = fixture.scene();
    fixture.config.episode.until = SWE_UNTIL_PUSH;
    const Scene scene = fixture.scene();
    const Channel& box = *find_channel("box");
    std::vector<double> all(50 * 3), begun(50 * 3);
    double homing[3];
    const swe_outcome longer = run(whole, kKey, 1, 1, homing, {{&box, all.data()}});
    const swe_outcome outcome = run(scene, kKey, 1, 1, homing, {{&box, begun.data()}});
    CHECK(outcome.push_time == longer.push_time);
    CHECK(outcome.control_steps == std::lround(outcome.push_time / 0.1));
    CHECK(outcome.hash != longer.hash);
    for (unsigned i = 0; i < 50 * 3; ++i)
        if (i < outcome.control_steps * 3)
            CHECK(begun[i] == all[i]);
        else
            CHECK(std::isnan(begun[i]));
}

TEST_CASE("an episode that ends with the push goes on to the horizon where there is none") {
    Fixture fixture;
    fixture.config.episode.horizon = 1;
    fixture.config.episode.until = SWE_UNTIL_PUSH;
    double homing[5];
    CHECK(run(fixture.scene(), kKey, 0, 0, homing).control_steps == 10);
}

TEST_CASE("who never arrives has no time") {
    Fixture fixture;
    fixture.config.episode.horizon = 1;
    double homing[5];
    const swe_outcome outcome = run(fixture.scene(), kKey, 0, 0, homing);
    CHECK(std::isnan(outcome.push_time));
    for (const double time : homing) CHECK(std::isnan(time));
}

TEST_CASE("an episode is a function of its key") {
    Fixture fixture;
    fixture.config.episode.horizon = 5;
    const Scene scene = fixture.scene();
    double homing[5];
    const auto hash = [&](const EpisodeKey& key) { return run(scene, key, 0.5, 0.4, homing).hash; };
    CHECK(hash(kKey) == hash(kKey));
    CHECK(hash(kKey) != hash({2, 2, 3, 4}));
    CHECK(hash(kKey) != hash({1, 3, 3, 4}));
    CHECK(hash(kKey) != hash({1, 2, 4, 4}));
    CHECK(hash(kKey) != hash({1, 2, 3, 5}));
}

TEST_CASE("telemetry tells what was seen and done before each step") {
    Fixture fixture;
    fixture.without_noise().config.episode.horizon = 1;
    const Scene scene = fixture.scene();
    std::map<std::string, std::vector<double>> values;
    Recorder recorder;
    for (std::size_t i = 0; i < channel_count(); ++i) {
        auto& own = values[channel(i).name];
        own.resize(scene.control_steps * channel(i).size(scene));
        recorder.push_back({&channel(i), own.data()});
    }
    double homing[5];
    run(scene, kKey, 2, -0.25, homing, recorder);
    const auto &pose = values["pose"], &command = values["command"];
    CHECK(pose.size() == 10 * 5 * 3);
    CHECK(pose[0] == doctest::Approx(-0.24));
    CHECK(pose[2] == doctest::Approx(-kPi / 2));
    CHECK(command[0] == 1);  // clipped
    CHECK(command[1] == -0.25);
    CHECK(values["infrared"][0] > 0);  // the south wall is 65 mm ahead
    CHECK(values["rf"][0] == 1);
    CHECK(values["box"][1] == doctest::Approx(0.345));
    CHECK(values["box_contact"][0] == 0);
    CHECK(values["touch"][0] == 0);
    CHECK(pose[pose.size() - 3] != pose[12]);
}

TEST_CASE("a moment is what telemetry records of it, but for the command, which is the last one") {
    Fixture fixture;
    fixture.config.episode.horizon = 1;
    const Scene scene = fixture.scene();
    std::map<std::string, std::vector<double>> values;
    Recorder recorder;
    for (std::size_t i = 0; i < channel_count(); ++i) {
        auto& own = values[channel(i).name];
        own.resize(scene.control_steps * channel(i).size(scene));
        recorder.push_back({&channel(i), own.data()});
    }
    Episode episode(scene, kKey, recorder);
    const std::vector<double> commands(10, 0.5);
    CHECK(std::isnan(episode.moment().commands[0]));
    for (unsigned step = 0; step < scene.control_steps; ++step) {
        std::map<std::string, std::vector<double>> now;
        for (std::size_t i = 0; i < channel_count(); ++i) {
            now[channel(i).name].resize(channel(i).size(scene));
            channel(i).write(now[channel(i).name].data(), episode.moment());
        }
        episode.advance(commands.data());
        for (auto& [name, seen] : now) {
            if (name == "command") continue;
            CHECK(std::equal(seen.begin(), seen.end(), values[name].begin() + step * seen.size()));
        }
        CHECK(episode.moment().commands[9] == 0.5);
    }
    CHECK(episode.done());
    episode.moment();  // there is one at the horizon, too
}

TEST_CASE("starts: jitter within its bounds, random ones free of everything") {
    Fixture fixture;
    const Scene row = fixture.scene();
    fixture.config.team.start = SWE_START_RANDOM;
    const Scene random = fixture.scene();
    for (unsigned repeat = 0; repeat < 200; ++repeat) {
        const EpisodeKey key = {5, 0, 0, repeat};
        const auto jittered = draw_starts(row, key).robots;
        for (unsigned i = 0; i < 5; ++i) {
            CHECK(std::abs(jittered[i].x - row.start_poses[i].x) <= 0.01);
            CHECK(std::abs(jittered[i].y - row.start_poses[i].y) <= 0.01);
            CHECK(std::abs(jittered[i].heading - row.start_poses[i].heading) <= 0.1);
        }
        const auto drawn = draw_starts(random, key).robots;
        for (unsigned i = 0; i < 5; ++i) {
            CHECK(std::abs(drawn[i].x) <= 0.45);
            CHECK((drawn[i].y >= -0.45 && drawn[i].y <= 0.15));
            for (unsigned j = 0; j < i; ++j)
                CHECK(std::hypot(drawn[i].x - drawn[j].x, drawn[i].y - drawn[j].y) >= 0.07);
        }
    }
}

TEST_CASE("a command that is not finite fails the episode and says whose it was") {
    const Fixture fixture;
    const Scene scene = fixture.scene();
    Episode episode(scene, kKey, {});
    double commands[10] = {};
    commands[7] = NAN;
    episode.observe();
    CHECK_THROWS_WITH_AS(episode.advance(commands), doctest::Contains("robot 3"), Error);
}

TEST_CASE("the goal can be any wall") {
    Fixture fixture;
    const auto touches = [&](int wall, const Pose& box) {
        fixture.config.goals[0].kind = wall;
        return is_at_any_goal(fixture.scene(), 0, box);
    };
    CHECK(touches(SWE_GOAL_NORTH, {0, 0.409, 0}));
    CHECK_FALSE(touches(SWE_GOAL_NORTH, {0, 0.407, 0}));
    CHECK(touches(SWE_GOAL_NORTH, {0, 0.361, kPi / 2}));
    CHECK(touches(SWE_GOAL_SOUTH, {0, -0.409, 0}));
    CHECK(touches(SWE_GOAL_EAST, {0.361, 0, 0}));
    CHECK(touches(SWE_GOAL_WEST, {-0.361, 0, 0}));
    CHECK_FALSE(touches(SWE_GOAL_WEST, {0.361, 0, 0}));
}

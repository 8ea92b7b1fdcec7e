// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "batch.hpp"
#include "error.hpp"
#include "fixture.hpp"

using namespace swarmevo;

namespace {

// Drives according to its parameters, steers by what it sees, and remembers how often it was called.
void steer(const void* parameters, const double* observation, double* memory, double* command) {
    const double* p = static_cast<const double*>(parameters);
    memory[0] += 1;
    command[0] = p[0] - observation[0] + 0.1 * std::sin(memory[0]);
    command[1] = p[1] - observation[7];
}

void fail(const void*, const double*, double*, double* command) {
    command[0] = command[1] = NAN;
}

struct Results {
    std::vector<swe_outcome> outcomes;
    std::vector<double> homing;
};

constexpr std::size_t kEpisodes = 12;
const double kParameters[3][2] = {{1, 0.9}, {0.3, 0.5}, {-1, 1}};

std::shared_ptr<const Scene> short_scene() {
    Fixture fixture;
    fixture.config.episode.horizon = 5;
    return std::make_shared<const Scene>(fixture.config);
}

std::vector<swe_policy> policies() {
    return {{steer, kParameters[0], 1, 0, 0},
            {steer, kParameters[1], 1, 0, 0},
            {steer, kParameters[2], 1, 0, 0},
            {fail, nullptr, 0, 0, 0}};
}

swe_episode episode(std::size_t i) {
    return {11, 0, 0, static_cast<std::uint32_t>(i % 4)};
}

std::uint32_t driver(std::size_t i, unsigned robot) {
    return static_cast<std::uint32_t>((i + robot) % 3);
}

// Runs the given episodes in one call.
Results run(unsigned threads, const std::vector<std::size_t>& which) {
    const auto scene = short_scene();
    Batch batch(scene, threads);
    std::vector<swe_episode> episodes;
    std::vector<std::uint32_t> drivers;
    for (const std::size_t i : which) {
        episodes.push_back(episode(i));
        for (unsigned robot = 0; robot < 5; ++robot) drivers.push_back(driver(i, robot));
    }
    Results results{std::vector<swe_outcome>(which.size()), std::vector<double>(which.size() * 5)};
    const auto p = policies();
    batch.run(results.outcomes.data(), results.homing.data(), std::vector<Recorder>(which.size()), episodes.data(),
              which.size(), p.data(), drivers.data());
    return results;
}

std::vector<std::size_t> all() {
    std::vector<std::size_t> which;
    for (std::size_t i = 0; i < kEpisodes; ++i) which.push_back(i);
    return which;
}

}  // namespace

TEST_CASE("the same episodes give the same bits on any number of threads, in any order and division") {
    const Results reference = run(1, all());
    for (const unsigned threads : {2u, 8u}) {
        const Results results = run(threads, all());
        for (std::size_t i = 0; i < kEpisodes; ++i) CHECK(results.outcomes[i].hash == reference.outcomes[i].hash);
    }
    const std::vector<std::size_t> reversed = {11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0};
    const Results backwards = run(2, reversed);
    for (std::size_t i = 0; i < kEpisodes; ++i)
        CHECK(backwards.outcomes[kEpisodes - 1 - i].hash == reference.outcomes[i].hash);
    for (std::size_t i = 0; i < kEpisodes; ++i) CHECK(run(1, {i}).outcomes[0].hash == reference.outcomes[i].hash);
}

TEST_CASE("lockstep gives the same bits as a native run") {
    const Results reference = run(2, all());
    const auto scene = short_scene();
    Batch batch(scene, 2);
    std::vector<swe_episode> episodes;
    for (const std::size_t i : all()) episodes.push_back(episode(i));
    batch.begin(std::vector<Recorder>(kEpisodes), episodes.data(), kEpisodes);
    std::vector<double> observations(kEpisodes * 5 * 13), commands(kEpisodes * 5 * 2), memory(kEpisodes * 5);
    while (batch.movable() > 0) {
        batch.observe(observations.data());
        for (std::size_t i = 0; i < kEpisodes; ++i)
            for (unsigned robot = 0; robot < 5; ++robot) {
                const std::size_t row = i * 5 + robot;
                steer(kParameters[driver(i, robot)], &observations[row * 13], &memory[row], &commands[row * 2]);
            }
        batch.advance(commands.data());
    }
    Results results{std::vector<swe_outcome>(kEpisodes), std::vector<double>(kEpisodes * 5)};
    batch.end(results.outcomes.data(), results.homing.data());
    for (std::size_t i = 0; i < kEpisodes; ++i) CHECK(results.outcomes[i].hash == reference.outcomes[i].hash);
}

TEST_CASE("a world that is reset begins anew, and the others go on as if nothing had happened") {
    const auto scene = short_scene();
    const std::size_t size = 5 * 2;
    const std::vector<double> commands(2 * size, 0.7);
    const swe_episode episodes[3] = {episode(0), episode(1), episode(2)};
    const auto outcomes = [&](Batch& batch) {
        std::vector<swe_outcome> now(batch.worlds());
        batch.state(now.data(), nullptr, std::vector<Recorder>(batch.worlds()));
        return now;
    };
    const auto hash_after = [&](const swe_episode& key, int steps) {
        Batch alone(scene, 1);
        alone.begin(std::vector<Recorder>(1), &key, 1);
        for (int i = 0; i < steps; ++i) alone.advance(commands.data());
        return outcomes(alone)[0].hash;
    };

    Batch batch(scene, 2);
    batch.begin(std::vector<Recorder>(2), episodes, 2);
    for (int i = 0; i < 30; ++i) batch.advance(commands.data());
    const std::uint32_t second = 1;
    batch.reset(&second, &episodes[2], 1);
    CHECK(outcomes(batch)[1].control_steps == 0);
    for (int i = 0; i < 30; ++i) batch.advance(commands.data());  // the first is at its horizon after 20 of them
    const auto now = outcomes(batch);
    CHECK(now[0].control_steps == 50);
    CHECK(now[0].hash == hash_after(episodes[0], 50));
    CHECK(now[1].control_steps == 30);
    CHECK(now[1].hash == hash_after(episodes[2], 30));
    CHECK(batch.movable() == 1);
    CHECK(batch.failed() == 0);
}

TEST_CASE("a world that has failed stands still, tells nothing, and can be reset") {
    Batch batch(short_scene(), 1);
    const swe_episode episodes[2] = {episode(0), episode(1)};
    batch.begin(std::vector<Recorder>(2), episodes, 2);
    std::vector<double> commands(2 * 5 * 2), observations(2 * 5 * 13), pose(2 * 5 * 3);
    const std::vector<Recorder> channels = {{{find_channel("pose"), &pose[0]}}, {{find_channel("pose"), &pose[15]}}};
    commands[3] = NAN;
    batch.advance(commands.data());
    CHECK(batch.failed() == 1);
    CHECK(batch.movable() == 1);
    CHECK(batch.message(0).find("robot 1") != std::string::npos);
    batch.observe(observations.data());
    swe_outcome outcomes[2];
    batch.state(outcomes, nullptr, channels);
    CHECK(observations[12] == 0);
    CHECK(observations[5 * 13 + 12] > 0);
    CHECK(std::isnan(pose[0]));
    CHECK(pose[16] < -0.38);
    CHECK(outcomes[0].status == SWE_POLICY_ERROR);
    const std::uint32_t first = 0;
    batch.reset(&first, episodes, 1);
    CHECK(batch.failed() == 0);
    CHECK(batch.message(0).empty());
}

TEST_CASE("an episode that fails fails alone and says why") {
    Batch batch(short_scene(), 2);
    const swe_episode episodes[2] = {episode(0), episode(1)};
    const std::uint32_t drivers[10] = {0, 0, 3, 0, 0, 1, 1, 1, 1, 1};
    swe_outcome outcomes[2];
    double homing[10];
    const auto p = policies();
    batch.run(outcomes, homing, std::vector<Recorder>(2), episodes, 2, p.data(), drivers);
    CHECK(outcomes[0].status == SWE_POLICY_ERROR);
    CHECK(batch.message(0).find("robot 2") != std::string::npos);
    CHECK(outcomes[1].status == SWE_OK);
    CHECK(batch.message(1).empty());
}

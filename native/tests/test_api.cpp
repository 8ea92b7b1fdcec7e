// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "fixture.hpp"

using namespace swarmevo;

namespace {

void stand_still(const void*, const double*, double*, double* command) {
    command[0] = command[1] = 0;
}

// A scene of one second and a batch on it.
struct Handles {
    Fixture fixture;
    swe_scene* scene = nullptr;
    swe_batch* batch = nullptr;
    swe_policy policy = {stand_still, nullptr, 0, 0, 0};
    std::vector<std::uint32_t> drivers = std::vector<std::uint32_t>(5, 0);
    swe_episode episode = {1, 0, 0, 0};
    swe_outcome outcome{};
    double homing[5];

    Handles() {
        fixture.config.episode.horizon = 1;
        REQUIRE(swe_scene_create(&scene, &fixture.config) == SWE_OK);
        REQUIRE(swe_batch_create(&batch, scene, 1) == SWE_OK);
    }
    ~Handles() {
        swe_scene_destroy(scene);  // before the batch: it keeps what it needs
        swe_batch_destroy(batch);
    }

    swe_status run(const std::vector<swe_channel>& channels = {}) {
        return swe_batch_run(&outcome, homing, channels.data(), channels.size(), batch, &episode, 1, &policy, 1,
                             drivers.data());
    }
};

bool complains(const char* part) {
    return std::string(swe_error_message()).find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("the library tells what it is") {
    CHECK(swe_abi_version() == SWE_ABI_VERSION);
    CHECK(std::string(swe_build_info()).find("ODE") != std::string::npos);
    std::uint32_t sizes[SWE_LAYOUT_SIZES];
    swe_abi_layout(sizes);
    CHECK(sizes[0] == sizeof(swe_scene_config));
    CHECK(sizes[4] == sizeof(swe_outcome));
    CHECK(swe_selftest_ode_error() == SWE_PHYSICS_ERROR);
    CHECK(complains("bad world argument"));
}

TEST_CASE("channels are told by number") {
    const Handles handles;
    swe_channel_info info;
    std::vector<std::string> names;
    for (std::uint32_t i = 0; i < swe_channel_count(); ++i) {
        REQUIRE(swe_channel_describe(&info, i, nullptr) == SWE_OK);
        const std::uint32_t fixed = info.width;
        REQUIRE(swe_channel_describe(&info, i, handles.scene) == SWE_OK);
        CHECK((info.width >= 1 || std::string(info.name) == "message"));  // which the paper's robots do not send
        CHECK((fixed == 0 || fixed == info.width));
        names.push_back(info.name);
    }
    CHECK(names.front() == "pose");
    CHECK(std::set<std::string>(names.begin(), names.end()).size() == names.size());
    CHECK(swe_channel_describe(&info, swe_channel_count(), nullptr) == SWE_INVALID_ARGUMENT);
    CHECK(complains("channel: expected a number below"));
    CHECK(swe_channel_describe(nullptr, 0, nullptr) == SWE_INVALID_ARGUMENT);
}

TEST_CASE("a scene tells how much robots observe and are told") {
    const Handles handles;
    CHECK(swe_scene_observations(handles.scene) == 13);
    CHECK(swe_scene_commands(handles.scene) == 2);
    CHECK(swe_scene_observations(nullptr) == 0);
    CHECK(swe_scene_commands(nullptr) == 0);
}

TEST_CASE("a controller for other observations or commands is refused") {
    Handles handles;
    handles.policy.observations = 12;
    CHECK(handles.run() == SWE_INVALID_ARGUMENT);
    CHECK(
        complains("policies[0]: expected a controller for the 13 observations of the scene's robots, got one for 12"));
    handles.policy.observations = 13;
    handles.policy.commands = 3;
    CHECK(handles.run() == SWE_INVALID_ARGUMENT);
    CHECK(complains("for the 2 commands"));
    handles.policy.commands = 2;
    CHECK(handles.run() == SWE_OK);
}

TEST_CASE("NULL is an error, never a crash, and destroying it is fine") {
    Handles handles;
    swe_scene* scene = nullptr;
    CHECK(swe_scene_create(nullptr, &handles.fixture.config) == SWE_INVALID_ARGUMENT);
    CHECK(swe_scene_create(&scene, nullptr) == SWE_INVALID_ARGUMENT);
    CHECK(complains("config"));
    CHECK(swe_batch_create(nullptr, handles.scene, 1) == SWE_INVALID_ARGUMENT);
    CHECK(swe_batch_create(&handles.batch, nullptr, 1) == SWE_INVALID_ARGUMENT);
    CHECK(swe_batch_run(nullptr, handles.homing, nullptr, 0, handles.batch, &handles.episode, 1, &handles.policy, 1,
                        handles.drivers.data()) == SWE_INVALID_ARGUMENT);
    CHECK(swe_batch_run(&handles.outcome, handles.homing, nullptr, 0, nullptr, &handles.episode, 1, &handles.policy, 1,
                        handles.drivers.data()) == SWE_INVALID_ARGUMENT);
    CHECK(swe_batch_run(&handles.outcome, handles.homing, nullptr, 0, handles.batch, &handles.episode, 1, nullptr, 0,
                        handles.drivers.data()) == SWE_INVALID_ARGUMENT);
    CHECK(swe_networks_policies(nullptr, 0, nullptr) == SWE_INVALID_ARGUMENT);
    swe_scene_destroy(nullptr);
    swe_batch_destroy(nullptr);
    swe_networks_destroy(nullptr);
    CHECK(swe_scene_robots(nullptr) == 0);
    CHECK(handles.run() == SWE_OK);
    CHECK(std::string(swe_error_message()).empty());
}

TEST_CASE("wrong sizes and indices are refused before anything runs") {
    Handles handles;
    std::vector<double> buffer(10 * 5 * 3);
    CHECK(handles.run({{"pose", buffer.data(), buffer.size() - 1}}) == SWE_INVALID_ARGUMENT);
    CHECK(complains("telemetry.pose: expected 150 values, got 149"));
    CHECK(handles.run({{"smell", buffer.data(), buffer.size()}}) == SWE_INVALID_ARGUMENT);
    CHECK(complains("telemetry.smell: expected a channel"));
    CHECK(handles.run({{nullptr, buffer.data(), buffer.size()}}) == SWE_INVALID_ARGUMENT);
    CHECK(handles.run({{"pose", nullptr, buffer.size()}}) == SWE_INVALID_ARGUMENT);
    CHECK(complains("telemetry.pose: expected a pointer, got NULL"));
    CHECK(handles.run({{"pose", buffer.data(), buffer.size()}}) == SWE_OK);
    CHECK(buffer[1] < -0.38);

    handles.drivers[3] = 1;
    CHECK(handles.run() == SWE_INVALID_ARGUMENT);
    CHECK(complains("robot_policies[3]"));
    handles.drivers[3] = 0;
    handles.episode.trial = 65536;
    CHECK(handles.run() == SWE_INVALID_ARGUMENT);
    handles.episode.trial = 0;
    handles.policy.function = nullptr;
    CHECK(handles.run() == SWE_INVALID_ARGUMENT);
    swe_batch* batch = nullptr;
    CHECK(swe_batch_create(&batch, handles.scene, 0) == SWE_INVALID_ARGUMENT);
    CHECK(swe_batch_create(&batch, handles.scene, 2000) == SWE_INVALID_ARGUMENT);
}

TEST_CASE("lockstep calls out of place are refused") {
    Handles h;
    std::vector<double> observations(5 * 13), commands(5 * 2);
    std::uint32_t movable = 9, failed = 9;
    const std::uint32_t world = 0;
    CHECK(swe_lockstep_observe(observations.data(), observations.size(), h.batch) == SWE_INVALID_ARGUMENT);
    CHECK(complains("swe_lockstep_begin first"));
    CHECK(swe_lockstep_count(&movable, &failed, h.batch) == SWE_INVALID_ARGUMENT);
    CHECK(swe_lockstep_reset(h.batch, &world, &h.episode, 1) == SWE_INVALID_ARGUMENT);
    CHECK(swe_lockstep_state(nullptr, nullptr, nullptr, 0, h.batch) == SWE_INVALID_ARGUMENT);
    REQUIRE(swe_lockstep_begin(h.batch, nullptr, 0, &h.episode, 1) == SWE_OK);
    CHECK(h.run() == SWE_INVALID_ARGUMENT);
    CHECK(complains("swe_lockstep_end first"));
    CHECK(swe_lockstep_observe(observations.data(), 3, h.batch) == SWE_INVALID_ARGUMENT);
    CHECK(swe_lockstep_advance(h.batch, commands.data(), 3) == SWE_INVALID_ARGUMENT);
    for (int i = 0; i < 10; ++i) {
        REQUIRE(swe_lockstep_observe(observations.data(), observations.size(), h.batch) == SWE_OK);
        REQUIRE(swe_lockstep_advance(h.batch, commands.data(), commands.size()) == SWE_OK);
    }
    CHECK(swe_lockstep_observe(observations.data(), observations.size(), h.batch) == SWE_OK);
    CHECK(swe_lockstep_advance(h.batch, commands.data(), commands.size()) == SWE_INVALID_ARGUMENT);
    CHECK(complains("expected a world that can go on"));
    REQUIRE(swe_lockstep_count(&movable, &failed, h.batch) == SWE_OK);
    CHECK(movable == 0);
    CHECK(failed == 0);
    CHECK(swe_lockstep_end(&h.outcome, h.homing, h.batch) == SWE_OK);
    CHECK(h.outcome.control_steps == 10);
    CHECK(h.run() == SWE_OK);
}

TEST_CASE("a lockstep that is reset wrongly goes on as it was") {
    Handles h;
    const swe_episode episodes[2] = {{1, 0, 0, 0}, {1, 0, 0, 1}};
    swe_episode wrong[2] = {{1, 0, 1, 0}, {1, 65536, 1, 1}};
    const std::vector<double> commands(2 * 5 * 2, 0.5);
    REQUIRE(swe_lockstep_begin(h.batch, nullptr, 0, episodes, 2) == SWE_OK);
    REQUIRE(swe_lockstep_advance(h.batch, commands.data(), commands.size()) == SWE_OK);
    const std::uint32_t both[2] = {0, 1}, beyond[2] = {0, 2}, twice[2] = {1, 1};
    CHECK(swe_lockstep_reset(h.batch, both, wrong, 2) == SWE_INVALID_ARGUMENT);
    CHECK(complains("episodes[1]: expected trial and repeat below 65536"));
    CHECK(swe_lockstep_reset(h.batch, beyond, episodes, 2) == SWE_INVALID_ARGUMENT);
    CHECK(complains("worlds[1]: expected an index below 2, got 2"));
    CHECK(swe_lockstep_reset(h.batch, twice, episodes, 2) == SWE_INVALID_ARGUMENT);
    CHECK(complains("worlds[1]: expected each world once, got 1 again"));
    CHECK(swe_lockstep_reset(h.batch, nullptr, episodes, 2) == SWE_INVALID_ARGUMENT);
    CHECK(swe_lockstep_reset(h.batch, both, nullptr, 2) == SWE_INVALID_ARGUMENT);
    CHECK(swe_lockstep_reset(nullptr, both, episodes, 2) == SWE_INVALID_ARGUMENT);
    CHECK(swe_lockstep_reset(h.batch, nullptr, nullptr, 0) == SWE_OK);
    swe_outcome outcomes[2];
    double homing[10];
    REQUIRE(swe_lockstep_state(outcomes, homing, nullptr, 0, h.batch) == SWE_OK);
    CHECK(outcomes[0].control_steps == 1);
    CHECK(outcomes[1].control_steps == 1);
    REQUIRE(swe_lockstep_reset(h.batch, both + 1, episodes, 1) == SWE_OK);
    REQUIRE(swe_lockstep_state(outcomes, nullptr, nullptr, 0, h.batch) == SWE_OK);
    CHECK(outcomes[0].control_steps == 1);
    CHECK(outcomes[1].control_steps == 0);
    CHECK(swe_lockstep_end(outcomes, homing, h.batch) == SWE_OK);
}

TEST_CASE("the state of a lockstep is what was asked for") {
    Handles h;
    REQUIRE(swe_lockstep_begin(h.batch, nullptr, 0, &h.episode, 1) == SWE_OK);
    std::vector<double> rf(5), command(10);
    const std::vector<swe_channel> channels = {{"rf", rf.data(), 5}, {"command", command.data(), 10}};
    REQUIRE(swe_lockstep_state(nullptr, nullptr, channels.data(), 2, h.batch) == SWE_OK);
    CHECK(rf[4] == 1);
    CHECK(std::isnan(command[0]));
    const swe_channel wrong = {"rf", rf.data(), 50};
    CHECK(swe_lockstep_state(nullptr, nullptr, &wrong, 1, h.batch) == SWE_INVALID_ARGUMENT);
    CHECK(complains("telemetry.rf: expected 5 values, got 50"));
    CHECK(swe_lockstep_state(nullptr, h.homing, nullptr, 0, h.batch) == SWE_INVALID_ARGUMENT);
    CHECK(swe_lockstep_state(nullptr, nullptr, nullptr, 0, nullptr) == SWE_INVALID_ARGUMENT);
}

// SPDX-License-Identifier: BSD-3-Clause
// The only extern "C" file: checks arguments, converts, and lets no exception out.
#include <cstring>
#include <memory>
#include <new>
#include <string>
#include <variant>

#include "batch.hpp"
#include "channels.hpp"
#include "error.hpp"
#include "networks/linear.hpp"
#include "networks/recurrent.hpp"
#include "policy.hpp"
#include "scene/scene.hpp"
#include "swarmevo.h"
#include "world/world.hpp"

using namespace swarmevo;

struct swe_scene {
    std::shared_ptr<const Scene> scene;
};
struct swe_networks {
    std::variant<Networks, LinearNetworks, RecurrentNetworks> networks;
};
struct swe_batch {
    Batch batch;
};

namespace {

constexpr unsigned kMaxThreads = 1024;
constexpr std::uint32_t kMaxTrialOrRepeat = 1u << 16;

thread_local std::string last_error;

template <typename Body>
swe_status guarded(Body body) noexcept {
    last_error.clear();
    try {
        body();
        return SWE_OK;
    } catch (const Error& error) {
        last_error = error.what();
        return error.status();
    } catch (const std::bad_alloc&) {
        last_error = "out of memory";
        return SWE_OUT_OF_MEMORY;
    } catch (const std::exception& error) {
        last_error = error.what();
        return SWE_INTERNAL_ERROR;
    }
}

[[noreturn]] void reject(const std::string& message) {
    throw Error(SWE_INVALID_ARGUMENT, message);
}

void require(const void* pointer, const char* name) {
    if (!pointer) reject(std::string(name) + ": expected a pointer, got NULL");
}

void require_length(std::size_t length, std::size_t expected, const char* name) {
    if (length != expected)
        reject(std::string(name) + ": expected " + std::to_string(expected) + " values, got " + std::to_string(length));
}

// "Not set" everywhere: a double whose bytes are all ones is a NaN, an integer is beyond its range.
template <typename Config>
void unset(Config* config) {
    std::memset(config, 0xFF, sizeof *config);
    config->struct_size = sizeof *config;
}

// Shares each channel's buffer out among n episodes of `steps` control steps.
std::vector<Recorder> make_recorders(const swe_channel* channels, std::size_t n_channels, const Scene& scene,
                                     std::size_t n, std::size_t steps) {
    std::vector<Recorder> recorders(n);
    if (n_channels > 0) require(channels, "channels");
    for (std::size_t c = 0; c < n_channels; ++c) {
        const swe_channel& wanted = channels[c];
        require(wanted.name, "channels: name");
        const std::string title = std::string("telemetry.") + wanted.name;
        const Channel* known = find_channel(wanted.name);
        if (!known) reject(title + ": expected a channel that swe_channel_describe tells, got none of that name");
        const std::size_t size = steps * known->size(scene);
        require_length(wanted.length, n * size, title.c_str());
        if (n > 0) require(wanted.values, title.c_str());
        for (std::size_t i = 0; i < n; ++i) recorders[i].push_back({known, wanted.values + i * size});
    }
    return recorders;
}

void check_episodes(const swe_episode* episodes, std::size_t n) {
    if (n > 0) require(episodes, "episodes");
    for (std::size_t i = 0; i < n; ++i)
        if (episodes[i].trial >= kMaxTrialOrRepeat || episodes[i].repeat >= kMaxTrialOrRepeat)
            reject("episodes[" + std::to_string(i) + "]: expected trial and repeat below 65536, got " +
                   std::to_string(episodes[i].trial) + ", " + std::to_string(episodes[i].repeat));
}

// Is a controller for what the robots of a scene observe, and for what they are told?
void check_fits(const swe_policy& policy, const std::string& title, const Scene& scene) {
    const auto fail = [&](const char* what, std::size_t has, std::uint32_t takes) {
        reject(title + ": expected a controller for the " + std::to_string(has) + " " + what +
               " of the scene's robots, got one for " + std::to_string(takes));
    };
    if (policy.observations && policy.observations != scene.suite.size())
        fail("observations", scene.suite.size(), policy.observations);
    if (policy.commands && policy.commands != scene.commands) fail("commands", scene.commands, policy.commands);
}

void check_policies(const swe_policy* policies, std::size_t n_policies, const std::uint32_t* robot_policies,
                    std::size_t n_robots, const Scene& scene) {
    require(policies, "policies");
    require(robot_policies, "robot_policies");
    for (std::size_t i = 0; i < n_policies; ++i) {
        const std::string title = "policies[" + std::to_string(i) + "]";
        if (!policies[i].function) reject(title + ".function: expected a pointer, got NULL");
        check_fits(policies[i], title, scene);
    }
    for (std::size_t i = 0; i < n_robots; ++i)
        if (robot_policies[i] >= n_policies)
            reject("robot_policies[" + std::to_string(i) + "]: expected an index below " + std::to_string(n_policies) +
                   ", got " + std::to_string(robot_policies[i]));
}

void check_lockstep(const swe_batch* batch, bool running) {
    require(batch, "batch");
    if (batch->batch.running() != running)
        reject(running ? "lockstep: expected swe_lockstep_begin first" : "lockstep: expected swe_lockstep_end first");
}

// Each world once.
void check_worlds(const std::uint32_t* worlds, std::size_t n, std::size_t all) {
    std::vector<bool> named(all);
    for (std::size_t i = 0; i < n; ++i) {
        const std::string title = "worlds[" + std::to_string(i) + "]: ";
        if (worlds[i] >= all)
            reject(title + "expected an index below " + std::to_string(all) + ", got " + std::to_string(worlds[i]));
        if (named[worlds[i]]) reject(title + "expected each world once, got " + std::to_string(worlds[i]) + " again");
        named[worlds[i]] = true;
    }
}

}  // namespace

extern "C" {

const char* swe_error_message(void) {
    return last_error.c_str();
}

uint32_t swe_abi_version(void) {
    return SWE_ABI_VERSION;
}

const char* swe_build_info(void) {
    static const std::string info = std::string("swarmevo " SWARMEVO_VERSION ", ") + SWARMEVO_COMPILER + ", " +
                                    ode_description() + ", Eigen " + std::to_string(EIGEN_WORLD_VERSION) + "." +
                                    std::to_string(EIGEN_MAJOR_VERSION) + "." + std::to_string(EIGEN_MINOR_VERSION) +
                                    ", sources " SWARMEVO_SOURCES;
    return info.c_str();
}

void swe_abi_layout(uint32_t sizes[SWE_LAYOUT_SIZES]) {
    const std::size_t all[SWE_LAYOUT_SIZES] = {
        sizeof(swe_scene_config), sizeof(swe_network_config), sizeof(swe_policy),
        sizeof(swe_episode),      sizeof(swe_outcome),        sizeof(swe_channel_info),
        sizeof(swe_channel),      sizeof(swe_linear_config),  sizeof(swe_recurrent_config)};
    for (int i = 0; i < SWE_LAYOUT_SIZES; ++i) sizes[i] = static_cast<std::uint32_t>(all[i]);
}

swe_status swe_selftest_ode_error(void) {
    return guarded(provoke_ode_assertion);
}

// ---- scene ----

void swe_scene_config_init(swe_scene_config* config) {
    unset(config);
    config->team.start_poses = nullptr;
}

swe_status swe_scene_create(swe_scene** scene, const swe_scene_config* config) {
    return guarded([&] {
        require(scene, "scene");
        require(config, "config");
        *scene = new swe_scene{std::make_shared<const Scene>(*config)};
    });
}

void swe_scene_destroy(swe_scene* scene) {
    delete scene;
}

uint32_t swe_scene_robots(const swe_scene* scene) {
    return scene ? scene->scene->robots : 0;
}
uint32_t swe_scene_movables(const swe_scene* scene) {
    return scene ? static_cast<uint32_t>(scene->scene->movables.size()) : 0;
}
uint32_t swe_scene_control_steps(const swe_scene* scene) {
    return scene ? scene->scene->control_steps : 0;
}

uint32_t swe_scene_observations(const swe_scene* scene) {
    return scene ? scene->scene->suite.size() : 0;
}
uint32_t swe_scene_commands(const swe_scene* scene) {
    return scene ? scene->scene->commands : 0;
}

// ---- networks ----

void swe_network_config_init(swe_network_config* config) {
    unset(config);
}

swe_status swe_networks_create(swe_networks** networks, const swe_network_config* config, size_t n,
                               const double* input_hidden, const double* hidden_output, const uint8_t* hidden_switch) {
    return guarded([&] {
        require(networks, "networks");
        require(config, "config");
        require(input_hidden, "input_hidden");
        require(hidden_output, "hidden_output");
        require(hidden_switch, "hidden_switch");
        *networks = new swe_networks{Networks(*config, n, input_hidden, hidden_output, hidden_switch)};
    });
}

void swe_networks_destroy(swe_networks* networks) {
    delete networks;
}

swe_status swe_networks_policies(swe_policy* policies, size_t capacity, const swe_networks* networks) {
    return guarded([&] {
        require(policies, "policies");
        require(networks, "networks");
        std::visit(
            [&](const auto& all) {
                require_length(capacity, all.size(), "policies");
                for (std::size_t i = 0; i < capacity; ++i) policies[i] = all.policy(i);
            },
            networks->networks);
    });
}

void swe_linear_config_init(swe_linear_config* config) {
    unset(config);
}

swe_status swe_linear_create(swe_networks** networks, const swe_linear_config* config, size_t n,
                             const double* input_output) {
    return guarded([&] {
        require(networks, "networks");
        require(config, "config");
        require(input_output, "input_output");
        *networks = new swe_networks{LinearNetworks(*config, n, input_output)};
    });
}

void swe_recurrent_config_init(swe_recurrent_config* config) {
    unset(config);
}

swe_status swe_recurrent_create(swe_networks** networks, const swe_recurrent_config* config, size_t n,
                                const double* input_hidden, const double* context_hidden, const double* hidden_output,
                                const double* time_constants, const uint8_t* hidden_switch) {
    return guarded([&] {
        require(networks, "networks");
        require(config, "config");
        require(input_hidden, "input_hidden");
        require(context_hidden, "context_hidden");
        require(hidden_output, "hidden_output");
        if (config->recurrence == SWE_RECURRENCE_CTRNN) require(time_constants, "time_constants");
        require(hidden_switch, "hidden_switch");
        *networks = new swe_networks{
            RecurrentNetworks(*config, n, input_hidden, context_hidden, hidden_output, time_constants, hidden_switch)};
    });
}

// ---- telemetry ----

uint32_t swe_channel_count(void) {
    return static_cast<std::uint32_t>(channel_count());
}

swe_status swe_channel_describe(swe_channel_info* info, uint32_t i, const swe_scene* scene) {
    return guarded([&] {
        require(info, "info");
        if (i >= channel_count())
            reject("channel: expected a number below " + std::to_string(channel_count()) + ", got " +
                   std::to_string(i));
        const Channel& described = channel(i);
        const unsigned width = scene ? described.width(*scene->scene) : described.fixed_width;
        *info = {described.name, described.per_robot, width};
    });
}

// ---- batch ----

swe_status swe_batch_create(swe_batch** batch, const swe_scene* scene, uint32_t threads) {
    return guarded([&] {
        require(batch, "batch");
        require(scene, "scene");
        if (threads < 1 || threads > kMaxThreads)
            reject("threads: expected 1 to " + std::to_string(kMaxThreads) + ", got " + std::to_string(threads));
        *batch = new swe_batch{{scene->scene, threads}};
    });
}

void swe_batch_destroy(swe_batch* batch) {
    if (batch && batch->batch.is_here()) delete batch;  // a fork leaves its copy to the end of the process
}

swe_status swe_batch_run(swe_outcome* outcomes, double* homing_times, const swe_channel* channels, size_t n_channels,
                         swe_batch* batch, const swe_episode* episodes, size_t n, const swe_policy* policies,
                         size_t n_policies, const uint32_t* robot_policies) {
    return guarded([&] {
        check_lockstep(batch, false);
        if (n == 0) return;
        require(outcomes, "outcomes");
        require(homing_times, "homing_times");
        check_episodes(episodes, n);
        const Scene& scene = batch->batch.scene();
        check_policies(policies, n_policies, robot_policies, n * scene.robots, scene);
        batch->batch.run(outcomes, homing_times, make_recorders(channels, n_channels, scene, n, scene.control_steps),
                         episodes, n, policies, robot_policies);
    });
}

const char* swe_batch_episode_message(const swe_batch* batch, size_t episode) {
    return batch ? batch->batch.message(episode).c_str() : "";
}

swe_status swe_lockstep_begin(swe_batch* batch, const swe_channel* channels, size_t n_channels,
                              const swe_episode* episodes, size_t n) {
    return guarded([&] {
        check_lockstep(batch, false);
        check_episodes(episodes, n);
        const Scene& scene = batch->batch.scene();
        batch->batch.begin(make_recorders(channels, n_channels, scene, n, scene.control_steps), episodes, n);
    });
}

swe_status swe_lockstep_observe(double* observations, size_t length, swe_batch* batch) {
    return guarded([&] {
        check_lockstep(batch, true);
        require(observations, "observations");
        const Scene& scene = batch->batch.scene();
        require_length(length, batch->batch.worlds() * scene.robots * scene.suite.size(), "observations");
        batch->batch.observe(observations);
    });
}

swe_status swe_lockstep_advance(swe_batch* batch, const double* commands, size_t length) {
    return guarded([&] {
        check_lockstep(batch, true);
        require(commands, "commands");
        const Scene& scene = batch->batch.scene();
        require_length(length, batch->batch.worlds() * scene.robots * scene.commands, "commands");
        if (batch->batch.movable() == 0)
            reject("lockstep: expected a world that can go on, but each is at its horizon or has failed: reset some");
        batch->batch.advance(commands);
    });
}

swe_status swe_lockstep_count(uint32_t* movable, uint32_t* failed, const swe_batch* batch) {
    return guarded([&] {
        require(movable, "movable");
        require(failed, "failed");
        check_lockstep(batch, true);
        *movable = static_cast<std::uint32_t>(batch->batch.movable());
        *failed = static_cast<std::uint32_t>(batch->batch.failed());
    });
}

swe_status swe_lockstep_reset(swe_batch* batch, const uint32_t* worlds, const swe_episode* episodes, size_t n) {
    return guarded([&] {
        check_lockstep(batch, true);
        if (n > 0) require(worlds, "worlds");
        check_episodes(episodes, n);
        check_worlds(worlds, n, batch->batch.worlds());
        batch->batch.reset(worlds, episodes, n);
    });
}

swe_status swe_lockstep_state(swe_outcome* outcomes, double* homing_times, const swe_channel* channels,
                              size_t n_channels, swe_batch* batch) {
    return guarded([&] {
        check_lockstep(batch, true);
        if (homing_times) require(outcomes, "outcomes");
        Batch& state = batch->batch;
        state.state(outcomes, homing_times, make_recorders(channels, n_channels, state.scene(), state.worlds(), 1));
    });
}

swe_status swe_lockstep_end(swe_outcome* outcomes, double* homing_times, swe_batch* batch) {
    return guarded([&] {
        check_lockstep(batch, true);
        if (batch->batch.worlds() > 0) {
            require(outcomes, "outcomes");
            require(homing_times, "homing_times");
        }
        batch->batch.end(outcomes, homing_times);
    });
}

}  // extern "C"

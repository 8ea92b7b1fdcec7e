// SPDX-License-Identifier: BSD-3-Clause
// Calls of a batch in any order, with any sizes, keys, commands and policies: every buffer is as long as it is said to
// be, so that a step beyond it is seen.
#include <cstdlib>
#include <memory>

#include "../tests/fixture.hpp"
#include "bytes.hpp"
#include "swarmevo.h"

namespace {

constexpr std::size_t kRobots = 2, kSteps = 3;

const swe_scene* scene() {
    static const swe_scene* made = [] {
        swarmevo::Fixture fixture({-0.2, -0.4, 0, 0.2, -0.4, 0});
        fixture.config.episode.horizon = 0.1 * kSteps;
        swe_scene* created = nullptr;
        if (swe_scene_create(&created, &fixture.config) != SWE_OK) std::abort();
        return created;
    }();
    return made;
}

std::vector<swe_episode> episodes(Bytes& bytes) {
    std::vector<swe_episode> made(bytes.below(4));
    for (auto& e : made)
        e = {bytes.take<std::uint64_t>(), bytes.take<std::uint32_t>() >> bytes.below(32), bytes.take<std::uint32_t>(),
             bytes.take<std::uint32_t>() >> bytes.below(32)};
    return made;
}

// Channels of the right length, or of any other.
struct Telemetry {
    std::vector<swe_channel> wanted;
    std::vector<std::vector<double>> buffers;

    Telemetry(Bytes& bytes, std::size_t n, std::size_t steps) {
        for (std::uint32_t i = 0; i < swe_channel_count(); ++i) {
            if (bytes.below(2)) continue;
            swe_channel_info info;
            swe_channel_describe(&info, i, scene());
            const std::size_t size = n * steps * info.width * (info.per_robot ? kRobots : 1);
            buffers.emplace_back(bytes.below(16) ? size : bytes.below(256));
            wanted.push_back({bytes.below(32) ? info.name : "smell", buffers.back().data(), buffers.back().size()});
        }
    }
};

void drive(const void* parameters, const double* observation, double* memory, double* command) {
    command[0] = *static_cast<const double*>(parameters);
    command[1] = observation[12] + memory[0]++;
}

void run(swe_batch* batch, Bytes& bytes) {
    const auto keys = episodes(bytes);
    const Telemetry telemetry(bytes, keys.size(), kSteps);
    const auto parameters = bytes.numbers(1 + bytes.below(3));
    std::vector<swe_policy> policies;
    for (const double& parameter : parameters) policies.push_back({drive, &parameter, 1, 0, 0});
    if (bytes.below(16) == 0) policies[0].function = nullptr;
    std::vector<std::uint32_t> chosen(keys.size() * kRobots);
    for (auto& policy : chosen)
        policy = static_cast<std::uint32_t>(bytes.below(bytes.below(16) ? policies.size() : 256));
    std::vector<swe_outcome> outcomes(keys.size());
    std::vector<double> homing(keys.size() * kRobots);
    const auto status = swe_batch_run(outcomes.data(), homing.data(), telemetry.wanted.data(), telemetry.wanted.size(),
                                      batch, keys.data(), keys.size(), policies.data(), policies.size(), chosen.data());
    if (status != SWE_OK && !*swe_error_message()) std::abort();
}

// Begins a lockstep and carries it on, in order or out of it.
void lockstep(swe_batch* batch, Bytes& bytes) {
    const auto keys = episodes(bytes);
    const Telemetry telemetry(bytes, keys.size(), kSteps);
    const auto& wanted = telemetry.wanted;
    if (swe_lockstep_begin(batch, wanted.data(), wanted.size(), keys.data(), keys.size()) != SWE_OK) return;
    std::vector<swe_outcome> outcomes(keys.size());
    std::vector<double> homing(keys.size() * kRobots);
    for (std::size_t calls = bytes.below(12); calls > 0; --calls) {
        const std::size_t robots = bytes.below(16) ? keys.size() * kRobots : bytes.below(16);
        switch (bytes.below(4)) {
            case 0: {
                std::vector<double> seen(robots * swe_scene_observations(scene()));
                swe_lockstep_observe(seen.data(), seen.size(), batch);
                break;
            }
            case 1: {
                const auto commands = bytes.numbers(robots * swe_scene_commands(scene()));
                swe_lockstep_advance(batch, commands.data(), commands.size());
                break;
            }
            case 2: {
                const auto others = episodes(bytes);
                std::vector<std::uint32_t> worlds(others.size());
                for (auto& world : worlds) world = static_cast<std::uint32_t>(bytes.below(bytes.below(16) ? 4 : 256));
                swe_lockstep_reset(batch, worlds.data(), others.data(), others.size());
                break;
            }
            default: {
                const Telemetry now(bytes, keys.size(), 1);
                const bool all = bytes.below(2);
                swe_lockstep_state(all ? outcomes.data() : nullptr, all ? homing.data() : nullptr, now.wanted.data(),
                                   now.wanted.size(), batch);
            }
        }
        std::uint32_t movable, failed;
        if (swe_lockstep_count(&movable, &failed, batch) != SWE_OK || movable + failed > keys.size()) std::abort();
    }
    swe_lockstep_end(outcomes.data(), homing.data(), batch);
    for (std::size_t i = 0; i < keys.size() + 1; ++i) (void)*swe_batch_episode_message(batch, i);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Bytes bytes(data, size);
    swe_batch* made = nullptr;
    if (swe_batch_create(&made, scene(), 1) != SWE_OK) std::abort();
    const std::unique_ptr<swe_batch, void (*)(swe_batch*)> batch(made, swe_batch_destroy);
    for (int calls = 0; calls < 8 && !bytes.empty(); ++calls) bytes.below(2) ? run(made, bytes) : lockstep(made, bytes);
    return 0;
}

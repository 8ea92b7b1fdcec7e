// SPDX-License-Identifier: BSD-3-Clause
// The paper's world with some of its bytes changed: refused with a message, or it runs.
#include <cmath>
#include <cstdlib>

#include "../tests/fixture.hpp"
#include "bytes.hpp"
#include "swarmevo.h"

namespace {

constexpr double kMostSteps = 400;  // of physics, so that a world is soon done
constexpr std::uint32_t kMostRobots = 8;

void patch(swe_scene_config& config, Bytes& bytes) {
    auto* raw = reinterpret_cast<unsigned char*>(&config);
    const std::size_t offset = bytes.take<std::uint16_t>() % (sizeof(config) - sizeof(double));
    if (bytes.below(2)) {  // a field of 4 bytes, or any bytes at all
        const auto value = bytes.take<std::int32_t>();
        std::memcpy(raw + offset, &value, sizeof(value));
    } else {  // a double
        const double value = bytes.number();
        std::memcpy(raw + offset / sizeof(double) * sizeof(double), &value, sizeof(value));
    }
}

void run(const swe_scene* scene) {
    const std::uint32_t robots = swe_scene_robots(scene);
    swe_batch* batch = nullptr;
    if (swe_batch_create(&batch, scene, 1) != SWE_OK) std::abort();
    const swe_policy forwards{[](const void*, const double*, double*, double* command) { command[0] = command[1] = 1; },
                              nullptr, 0, 0, 0};
    const swe_episode episode{1, 0, 0, 0};
    swe_outcome outcome{};
    std::vector<double> homing(robots);
    const std::vector<std::uint32_t> policies(robots, 0);
    if (swe_batch_run(&outcome, homing.data(), nullptr, 0, batch, &episode, 1, &forwards, 1, policies.data()) != SWE_OK)
        std::abort();
    swe_batch_destroy(batch);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Bytes bytes(data, size);
    swarmevo::Fixture fixture;
    fixture.config.episode.horizon = 0.3;
    while (!bytes.empty()) patch(fixture.config, bytes);
    const std::vector<double> poses = bytes.numbers(3 * std::min<std::uint32_t>(fixture.config.team.robots, 64));
    fixture.config.team.start_poses = fixture.config.team.robots == 5 ? fixture.poses.data() : poses.data();

    swe_scene* scene = nullptr;
    if (swe_scene_create(&scene, &fixture.config) != SWE_OK) {
        if (scene || !*swe_error_message()) std::abort();
        return 0;
    }
    const double steps = fixture.config.episode.horizon / fixture.config.physics.time_step;
    if (swe_scene_robots(scene) <= kMostRobots && steps <= kMostSteps) run(scene);
    swe_scene_destroy(scene);
    return 0;
}

// SPDX-License-Identifier: BSD-3-Clause
// Whole episodes without Python, for counting instructions:
//   valgrind --tool=callgrind episodes roaming|pushing|pressed|random
// The cases are those of benchmarks/cases.py, shorter.
#include <cstdio>
#include <cstring>
#include <vector>

#include "../../native/tests/fixture.hpp"
#include "rng.hpp"
#include "swarmevo.h"

using namespace swarmevo;

namespace {

struct Weights {
    std::vector<double> hidden = std::vector<double>(15 * 14), output = std::vector<double>(2 * 16);
    std::vector<std::uint8_t> on = std::vector<std::uint8_t>(15);
};

Weights avoiding() {
    Weights w;
    for (int sensor = 0; sensor < 8; ++sensor) {
        w.hidden[sensor * 14 + sensor] = 4;
        w.on[sensor] = 1;
    }
    w.output[15] = w.output[31] = 1.5;
    w.output[16] = w.output[17] = -4, w.output[18] = -1;
    w.output[5] = -1, w.output[6] = w.output[7] = -3;
    return w;
}

Weights driving() {
    Weights w;
    w.output[15] = w.output[31] = 1.47;
    return w;
}

Weights random_weights(unsigned number) {
    Weights w;
    unsigned i = 0;
    const auto next = [&] {
        const auto words = draw({number, 0, 0, 0}, Purpose::start, 0, i++);
        return normal(words[0], words[1]);
    };
    for (double& x : w.hidden) x = next();
    for (double& x : w.output) x = next();
    for (std::uint8_t& x : w.on) x = next() > 0;
    return w;
}

int run(const char* name) {
    Fixture fixture;
    std::vector<Weights> all;
    if (!std::strcmp(name, "roaming")) all = {avoiding()};
    if (!std::strcmp(name, "random"))
        for (unsigned i = 0; i < 40; ++i) all.push_back(random_weights(i));
    const bool pushing = !std::strcmp(name, "pushing"), pressed = !std::strcmp(name, "pressed");
    if (pushing || pressed) {
        all.assign(pushing ? 20 : 4, driving());
        if (pushing) fixture.config.arena.size[0] = fixture.config.arena.size[1] = 20;
        fixture.box_at(0, pushing ? -9.4 : 0.41);
        for (int i = 0; i < 5; ++i) {
            const double pose[] = {0.0715 * (i - 2), fixture.config.movables[0].pose[1] - 0.127, kPi / 2};
            std::copy_n(pose, 3, &fixture.poses[3 * static_cast<std::size_t>(i)]);
        }
        fixture.config.team.start_jitter[0] = fixture.config.team.start_jitter[1] = 0;
    }
    if (all.empty()) return std::fprintf(stderr, "expected roaming, pushing, pressed or random\n"), 2;
    fixture.config.episode.horizon = pushing ? 8 : 60;

    swe_scene* scene = nullptr;
    if (swe_scene_create(&scene, &fixture.config)) return std::fprintf(stderr, "%s\n", swe_error_message()), 1;
    swe_batch* batch = nullptr;
    swe_batch_create(&batch, scene, 1);
    const std::size_t rows = swe_scene_control_steps(scene) * 5u;
    std::vector<double> infrared(rows * 8), touch(rows * 4), rf(rows), command(rows * 2);
    const swe_channel channels[] = {{"infrared", infrared.data(), infrared.size()},
                                    {"touch", touch.data(), touch.size()},
                                    {"rf", rf.data(), rf.size()},
                                    {"command", command.data(), command.size()}};

    swe_network_config network{sizeof(swe_network_config), 15, 1, SWE_ACTIVATION_TANH, 13, 2};
    for (std::uint32_t i = 0; i < all.size(); ++i) {
        swe_networks* networks = nullptr;
        swe_networks_create(&networks, &network, 1, all[i].hidden.data(), all[i].output.data(), all[i].on.data());
        swe_policy policy;
        swe_networks_policies(&policy, 1, networks);
        const swe_episode episode{1, 0, 0, i};
        const std::uint32_t drivers[5] = {0, 0, 0, 0, 0};
        swe_outcome outcome;
        double homing[5];
        if (swe_batch_run(&outcome, homing, channels, 4, batch, &episode, 1, &policy, 1, drivers) || outcome.status)
            return std::fprintf(stderr, "%s\n", swe_batch_episode_message(batch, 0)), 1;
        swe_networks_destroy(networks);
    }
    std::printf("%g simulated seconds\n", all.size() * fixture.config.episode.horizon);
    swe_batch_destroy(batch);
    swe_scene_destroy(scene);
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    return run(argc > 1 ? argv[1] : "");
}

// SPDX-License-Identifier: BSD-3-Clause
// The channels of telemetry: one table, from which recording, sizes, checks and the state of a lockstep follow.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "scene/scene.hpp"
#include "sensors/snapshot.hpp"

namespace swarmevo {

// A control step as channels see it, before the step's commands act.
struct Moment {
    const Scene& scene;
    const Snapshot& now;
    const EpisodeKey& key;
    unsigned step;
    const char* at_goal;         // (movables): whether each is at a goal
    const double* observations;  // (robots, observations of the scene)
    const double* commands;      // (robots, commands of the scene), clipped
};

struct Channel {
    const char* name;
    bool per_robot;
    unsigned fixed_width;                                 // 0: it differs between scenes
    unsigned (*scene_width)(const Scene& scene);          // null where it does not
    void (*write)(double* values, const Moment& moment);  // (robots, width), or (width)

    // Values of each robot, or of the world.
    unsigned width(const Scene& scene) const { return scene_width ? scene_width(scene) : fixed_width; }

    // Values at one control step.
    std::size_t size(const Scene& scene) const { return (per_robot ? std::size_t{scene.robots} : 1) * width(scene); }
};

// The command behind bit i of all robots' messages, of commands (robots, commands of the scene).
inline double message_bit(const Scene& scene, const double* commands, std::size_t i) {
    return commands[i / scene.message_bits * scene.commands + 2 + i % scene.message_bits];
}

std::size_t channel_count();
const Channel& channel(std::size_t i);               // i below channel_count()
const Channel* find_channel(std::string_view name);  // null if there is none

// Where one episode writes a channel, step after step.
struct Track {
    const Channel* channel;
    double* values;
};
using Recorder = std::vector<Track>;

}  // namespace swarmevo

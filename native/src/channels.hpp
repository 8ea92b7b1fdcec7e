// SPDX-License-Identifier: BSD-3-Clause
// The channels of telemetry: one table, from which recording, sizes, checks and the state of a lockstep follow.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "scene/scene.hpp"
#include "sensors.hpp"

namespace swarmevo {

// A control step as channels see it, before the step's commands act.
struct Moment {
    const Snapshot& now;
    bool box_touches_target;
    const double* observations;  // (robots, SWE_OBSERVATIONS)
    const double* strengths;     // (robots): S
    const double* commands;      // (robots, SWE_COMMANDS), clipped
};

struct Channel {
    const char* name;
    bool per_robot;
    unsigned width;                                       // values of each robot, or of the world
    void (*write)(double* values, const Moment& moment);  // (robots, width), or (width)

    // Values at one control step.
    std::size_t size(const Scene& scene) const { return per_robot ? std::size_t{scene.robots} * width : width; }
};

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

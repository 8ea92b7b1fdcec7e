// SPDX-License-Identifier: BSD-3-Clause
#include "channels.hpp"

#include <algorithm>
#include <iterator>

namespace swarmevo {
namespace {

// Copies `width` of each robot's `stride` numbers, from the given one on.
void copy_columns(double* values, const double* rows, std::size_t robots, std::size_t stride, std::size_t from,
                  std::size_t width) {
    for (std::size_t robot = 0; robot < robots; ++robot)
        values = std::copy_n(rows + robot * stride + from, width, values);
}

void write_pose(double* values, const Moment& moment) {
    for (const Pose& pose : moment.now.robots) values = std::copy_n(&pose.x, 3, values);
}

void write_command(double* values, const Moment& moment) {
    copy_columns(values, moment.commands, moment.now.robots.size(), SWE_COMMANDS, 0, SWE_COMMANDS);
}

void write_infrared(double* values, const Moment& moment) {
    copy_columns(values, moment.observations, moment.now.robots.size(), SWE_OBSERVATIONS, 0, SWE_INFRARED_SENSORS);
}

void write_touch(double* values, const Moment& moment) {
    copy_columns(values, moment.observations, moment.now.robots.size(), SWE_OBSERVATIONS, SWE_INFRARED_SENSORS,
                 SWE_TOUCH_SENSORS);
}

void write_rf(double* values, const Moment& moment) {
    std::copy_n(moment.strengths, moment.now.robots.size(), values);
}

void write_box(double* values, const Moment& moment) {
    std::copy_n(&moment.now.box.x, 3, values);
}

void write_box_contact(double* values, const Moment& moment) {
    *values = moment.box_touches_target;
}

// CHANNELS in swarmevo/protocols.py says what they mean; loading the library compares names and shapes.
constexpr Channel kChannels[] = {
    {"pose", true, 3, write_pose},
    {"command", true, SWE_COMMANDS, write_command},
    {"infrared", true, SWE_INFRARED_SENSORS, write_infrared},
    {"touch", true, SWE_TOUCH_SENSORS, write_touch},
    {"rf", true, 1, write_rf},
    {"box", false, 3, write_box},
    {"box_contact", false, 1, write_box_contact},
};

}  // namespace

std::size_t channel_count() {
    return std::size(kChannels);
}

const Channel& channel(std::size_t i) {
    return kChannels[i];
}

const Channel* find_channel(std::string_view name) {
    const auto* found = std::find_if(std::begin(kChannels), std::end(kChannels),
                                     [&](const Channel& each) { return name == each.name; });
    return found == std::end(kChannels) ? nullptr : found;
}

}  // namespace swarmevo

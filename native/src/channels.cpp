// SPDX-License-Identifier: BSD-3-Clause
#include "channels.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "sensors/infrared.hpp"
#include "sensors/rf.hpp"
#include "sensors/touch.hpp"

namespace swarmevo {
namespace {

unsigned commands(const Scene& scene) {
    return scene.commands;
}

unsigned observations(const Scene& scene) {
    return scene.suite.size();
}

unsigned messages(const Scene& scene) {
    return scene.message_bits;
}

unsigned infrared(const Scene& scene) {
    return scene.sensors.infrared_count;
}

unsigned touch(const Scene& scene) {
    return scene.sensors.touch_count;
}

// What a device of each robot reads, whether or not the robots observe it.
void write_device(double* values, const Moment& moment, const Device& device, unsigned width) {
    const int place = moment.scene.suite.place_of(device.kind);
    const double* observation = moment.observations;
    for (unsigned robot = 0; robot < moment.scene.robots; ++robot) {
        if (place >= 0)
            std::copy_n(observation + place, width, values);
        else
            device.sense({moment.scene, moment.now, moment.key, moment.step, robot}, values);
        values += width;
        observation += moment.scene.suite.size();
    }
}

void write_pose(double* values, const Moment& moment) {
    for (const Pose& pose : moment.now.robots) values = std::copy_n(&pose.x, 3, values);
}

void write_command(double* values, const Moment& moment) {
    std::copy_n(moment.commands, moment.scene.robots * commands(moment.scene), values);
}

void write_observation(double* values, const Moment& moment) {
    std::copy_n(moment.observations, moment.scene.robots * observations(moment.scene), values);
}

void write_message(double* values, const Moment& moment) {
    for (std::size_t i = 0; i < moment.scene.robots * messages(moment.scene); ++i) {
        const double command = message_bit(moment.scene, moment.commands, i);
        values[i] = std::isnan(command) ? command : command > 0;
    }
}

void write_infrared(double* values, const Moment& moment) {
    write_device(values, moment, kInfrared, infrared(moment.scene));
}

void write_touch(double* values, const Moment& moment) {
    write_device(values, moment, kTouch, touch(moment.scene));
}

void write_rf(double* values, const Moment& moment) {
    for (unsigned robot = 0; robot < moment.scene.robots; ++robot)
        values[robot] = signal_strength({moment.scene, moment.now, moment.key, moment.step, robot});
}

void write_movables(double* values, const Moment& moment) {
    for (const Pose& pose : moment.now.movables) values = std::copy_n(&pose.x, 3, values);
}

void write_at_goal(double* values, const Moment& moment) {
    std::copy_n(moment.at_goal, moment.now.movables.size(), values);
}

unsigned movables(const Scene& scene) {
    return static_cast<unsigned>(scene.movables.size());
}

unsigned poses_of_movables(const Scene& scene) {
    return 3 * static_cast<unsigned>(scene.movables.size());
}

void write_box(double* values, const Moment& moment) {
    if (moment.now.movables.empty())
        std::fill_n(values, 3, std::numeric_limits<double>::quiet_NaN());
    else
        std::copy_n(&moment.now.movables[0].x, 3, values);
}

void write_box_contact(double* values, const Moment& moment) {
    *values = !moment.now.movables.empty() && moment.at_goal[0];
}

// CHANNELS in swarmevo/protocols.py says what they mean; loading the library compares names and shapes.
constexpr Channel kChannels[] = {
    {"pose", true, 3, nullptr, write_pose},
    {"command", true, 0, commands, write_command},
    {"message", true, 0, messages, write_message},
    {"observation", true, 0, observations, write_observation},
    {"infrared", true, 0, infrared, write_infrared},
    {"touch", true, 0, touch, write_touch},
    {"rf", true, 1, nullptr, write_rf},
    {"movables", false, 0, poses_of_movables, write_movables},
    {"at_goal", false, 0, movables, write_at_goal},
    {"box", false, 3, nullptr, write_box},
    {"box_contact", false, 1, nullptr, write_box_contact},
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

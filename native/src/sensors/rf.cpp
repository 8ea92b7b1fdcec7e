// SPDX-License-Identifier: BSD-3-Clause
#include "sensors/rf.hpp"

#include <algorithm>
#include <limits>

#include "sensors/geometry.hpp"

namespace swarmevo {
namespace {

double distance_to_emitter_squared(const Scene& scene, const Pose& robot) {
    return square(robot.x - scene.emitter.position[0]) + square(robot.y - scene.emitter.position[1]) +
           square(scene.robot.height - scene.emitter.position[2]);
}

unsigned width(const swe_sensors_config&) {
    return 1;
}

void sense(const Glimpse& glimpse, double* readings) {
    *readings = signal_strength(glimpse) / glimpse.scene.emitter.strength[1];
}

}  // namespace

bool in_emitter_range(const Scene& scene, const Pose& robot) {
    return distance_to_emitter_squared(scene, robot) <= square(scene.emitter.range);
}

double signal_strength(const Glimpse& glimpse) {
    const Scene& scene = glimpse.scene;
    const Pose& me = glimpse.me();
    const double least = scene.emitter.strength[0], most = scene.emitter.strength[1];
    if (scene.emitter.reach == SWE_REACH_RANGE && !in_emitter_range(scene, me)) return least;
    double strength = 1 / std::max(distance_to_emitter_squared(scene, me), std::numeric_limits<double>::min());
    if (scene.noise.rf > 0) {
        const auto words = glimpse.draw(Purpose::rf);
        strength *= 1 + scene.noise.rf * normal(words[0], words[1]);
    }
    return std::clamp(strength, least, most);
}

const Device kRf = {SWE_SENSOR_RF, width, sense};

}  // namespace swarmevo

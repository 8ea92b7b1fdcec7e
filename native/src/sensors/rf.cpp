// SPDX-License-Identifier: BSD-3-Clause
#include "sensors/rf.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sensors/geometry.hpp"

namespace swarmevo {
namespace {

double distance_squared(const Scene& scene, const swe_emitter_config& emitter, const Snapshot& now, unsigned robot) {
    const auto source = place_of(emitter, now);
    const Pose& me = now.robots[robot];
    return square(me.x - source[0]) + square(me.y - source[1]) + square(scene.robot.height - source[2]);
}

// Largest strength of any emitter, by which readings are divided; 1 where there is none.
double strongest_signal(const Scene& scene) {
    double most = 0;
    for (const swe_emitter_config& emitter : scene.emitters) most = std::max(most, emitter.strength[1]);
    return most > 0 ? most : 1;
}

unsigned width(const swe_sensors_config&) {
    return 1;
}

void sense(const Glimpse& glimpse, double* readings) {
    *readings = signal_strength(glimpse) / strongest_signal(glimpse.scene);
}

}  // namespace

std::array<double, 3> place_of(const swe_emitter_config& emitter, const Snapshot& now) {
    const double *p = emitter.position, x = p[0], y = p[1];
    if (emitter.rides_on == SWE_NOTHING) return {x, y, p[2]};
    const Pose& carrier = now.movables[emitter.rides_on];
    const double cosine = std::cos(carrier.heading), sine = std::sin(carrier.heading);
    return {carrier.x + cosine * x - sine * y, carrier.y + sine * x + cosine * y, p[2]};
}

bool in_emitter_range(const Scene& scene, const Snapshot& now, unsigned robot) {
    return std::any_of(scene.emitters.begin(), scene.emitters.end(), [&](const swe_emitter_config& emitter) {
        return emitter.channel == 0 && distance_squared(scene, emitter, now, robot) <= square(emitter.range);
    });
}

double signal_strength(const Glimpse& glimpse, unsigned channel) {
    const Scene& scene = glimpse.scene;
    double strongest = 0;
    for (unsigned i = 0; i < scene.emitters.size(); ++i) {
        const swe_emitter_config& emitter = scene.emitters[i];
        if (emitter.channel != channel) continue;
        const double least = emitter.strength[0], most = emitter.strength[1];
        const double squared = distance_squared(scene, emitter, glimpse.now, glimpse.robot);
        double strength = least;
        if (emitter.reach != SWE_REACH_RANGE || squared <= square(emitter.range)) {
            strength = 1 / std::max(squared, std::numeric_limits<double>::min());
            if (scene.noise.rf > 0) {
                const auto words = glimpse.draw(Purpose::rf, i);
                strength *= 1 + scene.noise.rf * normal(words[0], words[1]);
            }
            strength = std::clamp(strength, least, most);
        }
        strongest = std::max(strongest, strength);
    }
    return strongest;
}

const Device kRf = {SWE_SENSOR_RF, width, sense};

}  // namespace swarmevo

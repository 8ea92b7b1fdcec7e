// SPDX-License-Identifier: BSD-3-Clause
#include "sensors/light.hpp"

#include <algorithm>
#include <cmath>

#include "sensors/rf.hpp"
#include "sensors/sectors.hpp"

namespace swarmevo {
namespace {

unsigned width(const swe_scene_config& checked) {
    return checked.sensors.light_sectors;
}

void sense(const Glimpse& glimpse, double* readings) {
    const Scene& scene = glimpse.scene;
    const Pose& me = glimpse.me();
    std::fill_n(readings, scene.sensors.light_sectors, 0.0);
    for (unsigned i = 0; i < scene.emitters.size(); ++i) {
        const swe_emitter_config& light = scene.emitters[i];
        if (light.channel != SWE_CHANNEL_LIGHT || !is_heard(glimpse, light)) continue;
        const auto source = place_of(light, glimpse.now);
        const double bearing = std::atan2(source[1] - me.y, source[0] - me.x) - me.heading;
        double& reading = readings[sector_of(bearing, scene.sensors.light_sectors)];
        reading = std::max(reading, strength_of(glimpse, i, Purpose::light, scene.noise.light) / light.strength[1]);
    }
}

}  // namespace

const Device kLight = {SWE_SENSOR_LIGHT, width, sense};

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
#include "sensors/range_and_bearing.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "scene/scene.hpp"
#include "sensors/sectors.hpp"

namespace swarmevo {
namespace {

unsigned width(const swe_scene_config& checked) {
    return checked.sensors.range_and_bearing_sectors * (1 + checked.sensors.range_and_bearing_message);
}

struct Neighbour {
    unsigned robot;
    double distance_squared = kNothing;
};

// The nearest robot within range in each sector; of equally near ones the first.
using Neighbours = std::array<Neighbour, SWE_MAX_SECTORS>;
Neighbours neighbours_of(const Glimpse& glimpse) {
    const swe_sensors_config& sensors = glimpse.scene.sensors;
    const Pose& me = glimpse.me();
    Neighbours neighbours;
    for (unsigned i = 0; i < glimpse.now.robots.size(); ++i) {
        const double x = glimpse.now.robots[i].x - me.x, y = glimpse.now.robots[i].y - me.y;
        const double distance_squared = x * x + y * y;
        if (i == glimpse.robot || distance_squared > square(sensors.range_and_bearing_range)) continue;
        Neighbour& nearest = neighbours[sector_of(std::atan2(y, x) - me.heading, sensors.range_and_bearing_sectors)];
        if (distance_squared < nearest.distance_squared) nearest = {i, distance_squared};
    }
    return neighbours;
}

double proximity(const Glimpse& glimpse, const Neighbour& neighbour, unsigned sector) {
    double distance = std::sqrt(neighbour.distance_squared);
    if (glimpse.scene.noise.range_and_bearing > 0) {
        const auto words = glimpse.draw(Purpose::range_and_bearing, sector);
        distance *= 1 + glimpse.scene.noise.range_and_bearing * normal(words[0], words[1]);
    }
    return std::clamp(1 - distance / glimpse.scene.sensors.range_and_bearing_range, 0.0, 1.0);
}

void sense(const Glimpse& glimpse, double* readings) {
    const unsigned sectors = glimpse.scene.sensors.range_and_bearing_sectors, bits = glimpse.scene.message_bits;
    const Neighbours neighbours = neighbours_of(glimpse);
    for (unsigned sector = 0; sector < sectors; ++sector) {
        const Neighbour& nearest = neighbours[sector];
        const bool is_there = nearest.distance_squared < kNothing;
        *readings++ = is_there ? proximity(glimpse, nearest, sector) : 0;
        for (unsigned bit = 0; bit < bits; ++bit)
            *readings++ = is_there ? glimpse.now.messages[nearest.robot * bits + bit] : 0;
    }
}

}  // namespace

const Device kRangeAndBearing = {SWE_SENSOR_RANGE_AND_BEARING, width, sense};

}  // namespace swarmevo

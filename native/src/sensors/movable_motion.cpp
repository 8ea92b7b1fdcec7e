// SPDX-License-Identifier: BSD-3-Clause
#include "sensors/movable_motion.hpp"

#include <algorithm>
#include <cmath>

#include "epuck.hpp"
#include "sensors/touch.hpp"

namespace swarmevo {
namespace {

unsigned width(const swe_scene_config&) {
    return 3;
}

double share(double speed, double fastest) {
    return std::clamp(speed / fastest, -1.0, 1.0);
}

void sense(const Glimpse& glimpse, double* readings) {
    std::fill_n(readings, 3, 0.0);
    const Twist* touched = nullptr;
    double nearest = glimpse.scene.sensors.touch_range;
    for (unsigned i = 0; i < glimpse.now.movables.size(); ++i) {
        const double gap = gap_to(glimpse, i);
        if (gap <= nearest) nearest = gap, touched = &glimpse.now.motions[i];
    }
    if (!touched) return;
    const double heading = glimpse.me().heading, cosine = std::cos(heading), sine = std::sin(heading);
    const double fastest = rim_speed(glimpse.scene.robot, 1, 0);
    readings[0] = share(cosine * touched->x + sine * touched->y, fastest);
    readings[1] = share(cosine * touched->y - sine * touched->x, fastest);
    readings[2] =
        share(touched->spin, 2 * fastest / glimpse.scene.robot.axle_length);  // as the robot turns on the spot
}

}  // namespace

const Device kMovableMotion = {SWE_SENSOR_MOVABLE_MOTION, width, sense};

}  // namespace swarmevo

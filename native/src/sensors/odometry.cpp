// SPDX-License-Identifier: BSD-3-Clause
#include "sensors/odometry.hpp"

#include <algorithm>

namespace swarmevo {
namespace {

unsigned width(const swe_scene_config&) {
    return 2;
}

void sense(const Glimpse& glimpse, double* readings) {
    for (unsigned side = 0; side < 2; ++side) {
        double speed = glimpse.now.wheel_speeds[2 * glimpse.robot + side] / glimpse.scene.robot.top_speed;
        if (glimpse.scene.noise.odometry > 0) {
            const auto words = glimpse.draw(Purpose::odometry, side);
            speed *= 1 + glimpse.scene.noise.odometry * normal(words[0], words[1]);
        }
        readings[side] = std::clamp(speed, -1.0, 1.0);
    }
}

}  // namespace

const Device kOdometry = {SWE_SENSOR_ODOMETRY, width, sense};

}  // namespace swarmevo

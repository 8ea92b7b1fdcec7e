// SPDX-License-Identifier: BSD-3-Clause
#include "sensors/touch.hpp"

#include <algorithm>
#include <cmath>

#include "epuck.hpp"

namespace swarmevo {
namespace {

double angle_between(double a, double b) {
    return std::abs(std::remainder(a - b, 2 * kPi));
}

unsigned width(const swe_sensors_config& sensors) {
    return sensors.touch_count;
}

}  // namespace

void sense_touch(const Glimpse& glimpse, double* readings) {
    const Scene& scene = glimpse.scene;
    const unsigned sensors = scene.sensors.touch_count;
    std::fill_n(readings, sensors, 0.0);
    const Pose &me = glimpse.me(), &box = glimpse.now.box;
    const double cosine = std::cos(box.heading), sine = std::sin(box.heading);
    const double dx = me.x - box.x, dy = me.y - box.y;
    const Separation s = separate_point_from_rectangle(cosine * dx + sine * dy, cosine * dy - sine * dx,
                                                       scene.box.size[0] / 2, scene.box.size[1] / 2);
    const double gap = s.distance - scene.robot.radius;
    if (gap > scene.sensors.touch_range) return;

    double strength = 1;
    if (scene.sensors.touch_mode == SWE_TOUCH_MODE_GRADED)
        strength = 1 - std::max(0.0, gap) / scene.sensors.touch_range;
    if (scene.sensors.touch_mode == SWE_TOUCH_MODE_FORCE)
        strength = std::min(1.0, glimpse.now.push_forces[glimpse.robot] / traction_limit(scene));

    // The nearest point lies against the normal, which leads from the box to the robot.
    const double towards_box = std::atan2(-s.normal_y, -s.normal_x) + box.heading - me.heading;
    for (unsigned sensor = 0; sensor < sensors; ++sensor) {
        const double centre = scene.sensors.touch_yaw_deg[sensor] * kRadiansPerDegree;
        if (angle_between(towards_box, centre) <= scene.sensors.touch_half_width_deg * kRadiansPerDegree)
            readings[sensor] = strength;
    }
}

const Device kTouch = {SWE_SENSOR_TOUCH, width, sense_touch};

}  // namespace swarmevo

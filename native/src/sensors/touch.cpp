// SPDX-License-Identifier: BSD-3-Clause
#include "sensors/touch.hpp"

#include <algorithm>
#include <cmath>

#include "epuck.hpp"
#include "scene/scene.hpp"

namespace swarmevo {
namespace {

double angle_between(double a, double b) {
    return std::abs(std::remainder(a - b, 2 * kPi));
}

// Is the robot so far from a movable that no point of it is in reach of touch sensors? Cheaper than to separate them.
bool is_far(const Glimpse& glimpse, unsigned number) {
    const Pose &me = glimpse.me(), &movable = glimpse.now.movables[number];
    const double reach = glimpse.scene.movables[number].figure.reach + glimpse.scene.robot.radius;
    return square(me.x - movable.x) + square(me.y - movable.y) > square(reach + glimpse.scene.sensors.touch_range);
}

// The robot's centre from a movable, in the movable's own frame.
Separation separate(const Glimpse& glimpse, unsigned number) {
    const Pose &me = glimpse.me(), &movable = glimpse.now.movables[number];
    const double cosine = std::cos(movable.heading), sine = std::sin(movable.heading);
    const double dx = me.x - movable.x, dy = me.y - movable.y;
    return glimpse.scene.movables[number].figure.separate(cosine * dx + sine * dy, cosine * dy - sine * dx);
}

unsigned width(const swe_scene_config& checked) {
    return checked.sensors.touch_count;
}

}  // namespace

double gap_to(const Glimpse& glimpse, unsigned movable) {
    if (is_far(glimpse, movable)) return kNothing;
    return separate(glimpse, movable).distance - glimpse.scene.robot.radius;
}

void sense_touch(const Glimpse& glimpse, double* readings) {
    const Scene& scene = glimpse.scene;
    const unsigned sensors = scene.sensors.touch_count;
    std::fill_n(readings, sensors, 0.0);
    const Pose& me = glimpse.me();
    const std::vector<Pose>& movables = glimpse.now.movables;
    for (unsigned i = 0; i < movables.size(); ++i) {
        if (is_far(glimpse, i)) continue;
        const Pose& movable = movables[i];
        const Separation s = separate(glimpse, i);
        const double gap = s.distance - scene.robot.radius;
        if (gap > scene.sensors.touch_range) continue;

        double strength = 1;
        if (scene.sensors.touch_mode == SWE_TOUCH_MODE_GRADED)
            strength = 1 - std::max(0.0, gap) / scene.sensors.touch_range;
        if (scene.sensors.touch_mode == SWE_TOUCH_MODE_FORCE)
            strength =
                std::min(1.0, glimpse.now.push_forces[glimpse.robot * movables.size() + i] / traction_limit(scene));

        // The nearest point lies against the normal, which leads from the movable to the robot.
        const double towards = std::atan2(-s.normal_y, -s.normal_x) + movable.heading - me.heading;
        for (unsigned sensor = 0; sensor < sensors; ++sensor) {
            const double centre = scene.sensors.touch_yaw_deg[sensor] * kRadiansPerDegree;
            if (angle_between(towards, centre) <= scene.sensors.touch_half_width_deg * kRadiansPerDegree)
                readings[sensor] = std::max(readings[sensor], strength);
        }
    }
}

const Device kTouch = {SWE_SENSOR_TOUCH, width, sense_touch};

}  // namespace swarmevo

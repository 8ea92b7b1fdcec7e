// SPDX-License-Identifier: BSD-3-Clause
// Whether a robot's list of sensors names devices that there are, and whether these can work.
#include <algorithm>
#include <cstdint>
#include <string>

#include "scene/check.hpp"
#include "sensors/suite.hpp"

namespace swarmevo {
namespace {

void check_list(Check& check, const swe_robot_config& r) {
    if (!check.range("robot.sensors", r.sensor_count, 0, SWE_MAX_DEVICES, "devices")) return;
    const std::int32_t* end = r.sensors + r.sensor_count;
    for (const std::int32_t* one = r.sensors; one != end; ++one) {
        const std::string field = "robot.sensors[" + std::to_string(one - r.sensors) + "]";
        if (!find_device(*one))
            check.fail(field + ": not set, or not one of SWE_SENSOR_* (" + number(*one) + ")");
        else if (std::find(r.sensors, one, *one) != one)
            check.fail(field + ": expected each device once, got one that is there before it");
    }
}

void check_infrared(Check& check, const swe_sensors_config& s) {
    if (check.range("sensors.infrared_yaw_deg", s.infrared_count, 1, SWE_MAX_INFRARED, "rays"))
        check.ranges("sensors.infrared_yaw_deg", s.infrared_yaw_deg, s.infrared_count, -360, 360, "deg");
    if (check.range("sensors.infrared_curve points", s.infrared_curve_points, 2, SWE_MAX_CURVE_POINTS, "")) {
        for (unsigned i = 0; i < s.infrared_curve_points; ++i) {
            const std::string point = "sensors.infrared_curve[" + std::to_string(i) + "]";
            const bool good = check.range(point + "[0]", s.infrared_curve[i][0], 0, 10, "m") &&
                              check.range(point + "[1]", s.infrared_curve[i][1], 0, 1e6, "");
            if (good && i > 0 && !(s.infrared_curve[i - 1][0] < s.infrared_curve[i][0]))
                check.fail(point + ": expected a distance above the one before, got " + number(s.infrared_curve[i][0]));
        }
        if (!(s.infrared_curve[0][1] > 0))
            check.fail("sensors.infrared_curve[0][1]: expected a value above 0, by which all are divided, got " +
                       number(s.infrared_curve[0][1]));
    }
    check.choice("sensors.infrared_target", s.infrared_target, SWE_INFRARED_TARGET_ALL);
}

void check_touch(Check& check, const swe_sensors_config& s) {
    if (check.range("sensors.touch_yaw_deg", s.touch_count, 1, SWE_MAX_TOUCH, "sectors"))
        check.ranges("sensors.touch_yaw_deg", s.touch_yaw_deg, s.touch_count, -360, 360, "deg");
    check.range("sensors.touch_half_width_deg", s.touch_half_width_deg, 0.1, 180, "deg");
    check.range("sensors.touch_range", s.touch_range, 0.0001, 10, "m");
    check.choice("sensors.touch_mode", s.touch_mode, SWE_TOUCH_MODE_FORCE);
}

void check_range_and_bearing(Check& check, const swe_robot_config& r, const swe_sensors_config& s) {
    check.range("sensors.range_and_bearing_range", s.range_and_bearing_range, 0.01, 100, "m");
    check.range("sensors.range_and_bearing_sectors", s.range_and_bearing_sectors, 1, SWE_MAX_SECTORS, "sectors");
    if (!check.range("sensors.range_and_bearing_message", s.range_and_bearing_message, 0, SWE_MAX_MESSAGE, "bits"))
        return;
    const std::int32_t* end = r.sensors + std::min<std::uint32_t>(r.sensor_count, SWE_MAX_DEVICES);
    if (s.range_and_bearing_message > 0 && std::find(r.sensors, end, SWE_SENSOR_RANGE_AND_BEARING) == end)
        check.fail("sensors.range_and_bearing_message: expected 0 bits of a robot without range_and_bearing, got " +
                   number(s.range_and_bearing_message) + ": add range_and_bearing to robot.sensors, or set 0");
}

void check_light(Check& check, const swe_sensors_config& s) {
    check.range("sensors.light_sectors", s.light_sectors, 1, SWE_MAX_SECTORS, "sectors");
}

void check_ground(Check& check, const swe_sensors_config& s) {
    if (!check.range("sensors.ground_position", s.ground_count, 1, SWE_MAX_GROUND, "places")) return;
    for (unsigned i = 0; i < s.ground_count; ++i)
        check.ranges("sensors.ground_position[" + std::to_string(i) + "]", s.ground_position[i], -1, 1, "m");
}

}  // namespace

void check_sensors(Check& check, const swe_scene_config& c) {
    check_list(check, c.robot);
    check_infrared(check, c.sensors);
    check_touch(check, c.sensors);
    check_range_and_bearing(check, c.robot, c.sensors);
    check_ground(check, c.sensors);
    check_light(check, c.sensors);
}

}  // namespace swarmevo

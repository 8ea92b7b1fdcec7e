// SPDX-License-Identifier: BSD-3-Clause
// Whether a robot can be built, and stands.
#include <algorithm>
#include <cmath>
#include <string>

#include "epuck.hpp"
#include "scene/check.hpp"

namespace swarmevo {
namespace {

// Largest slope of a robot that leans on a caster: the sides of bodies are taken to be upright.
constexpr double kSteepestLean = 0.1;

// Wheels and casters lie within the body's disc.
void check_robot_shape(Check& check, const swe_robot_config& r) {
    const double largest_wheel = std::min(r.height / 2, r.radius);
    if (r.wheel_radius > largest_wheel)
        check.fail("robot.wheel_radius: expected at most half of robot.height and robot.radius (" +
                   number(largest_wheel) + " m), got " + number(r.wheel_radius) + " m");
    const double wheel = std::min(r.wheel_radius, r.radius);
    const double longest_axle = 2 * std::sqrt(r.radius * r.radius - wheel * wheel);
    if (r.wheel_radius <= largest_wheel && r.axle_length > longest_axle)
        check.fail("robot.axle_length: expected wheels within the body, at most " + number(longest_axle) +
                   " m apart by robot.radius and robot.wheel_radius, got " + number(r.axle_length) + " m");
    if (r.caster_offset > r.radius)
        check.fail("robot.caster_offset: expected at most robot.radius (" + number(r.radius) + " m), got " +
                   number(r.caster_offset) + " m");
    const double largest_clearance = kSteepestLean * r.caster_offset;
    if (r.caster_clearance > largest_clearance)
        check.fail("robot.caster_clearance: expected at most a tenth of robot.caster_offset (" +
                   number(largest_clearance) + " m), for tilts are taken to be small, got " +
                   number(r.caster_clearance) + " m");
}

// The robot stands on its wheels and a caster. Where the model keeps it level, skidding sideways must not turn it over;
// forwards it cannot: what load goes to a caster is lost to the wheels.
void check_centre_of_mass(Check& check, const swe_robot_config& r, const swe_physics_config& physics) {
    const auto fail = [&](const std::string& expected, const std::string& advice) {
        check.fail("robot.centre_of_mass: expected " + expected + ", got " + number(r.centre_of_mass) + " m" + advice);
    };
    const double standing = r.caster_offset * r.caster_offset / r.caster_clearance;
    const double skidding = r.axle_length / 2 / physics.wheel_friction;
    const double lowest = 2 * kWheelShare * r.wheel_radius;
    if (r.centre_of_mass >= r.height)
        fail("less than robot.height (" + number(r.height) + " m)", "");
    else if (r.caster_clearance > 0 && r.centre_of_mass >= standing)
        fail("less than " + number(standing) + " m, or the robot falls over its caster",
             ": lower it, reduce robot.caster_clearance or enlarge robot.caster_offset");
    else if (physics.drive == SWE_DRIVE_DRIVEN_CONTACTS && physics.wheel_friction > 0 && r.centre_of_mass > skidding)
        fail("at most " + number(skidding) + " m, or the robot falls on its side as it skids",
             ": lower it, reduce physics.wheel_friction or set physics.drive to articulated");
    else if (physics.drive == SWE_DRIVE_ARTICULATED && r.centre_of_mass <= lowest)
        fail("more than " + number(lowest) + " m, or the chassis's own centre lies below the floor",
             ": raise it or reduce robot.wheel_radius");
}

// The stop lies within the body. A bumper that gives way further than its travel under the robot's own push is fine: it
// ends at the stop.
void check_bumper(Check& check, const swe_robot_config& r) {
    check.choice("robot.bumper", r.bumper, SWE_BUMPER_RIGID);
    check.range("robot.bumper_stiffness", r.bumper_stiffness, 1, 1e6, "N/m");
    check.range("robot.bumper_damping", r.bumper_damping, 0, 1e5, "N s/m");
    if (check.range("robot.bumper_travel", r.bumper_travel, 0.0001, 1, "m") && r.bumper_travel > r.radius / 2)
        check.fail("robot.bumper_travel: expected at most half of robot.radius (" + number(r.radius / 2) + " m), got " +
                   number(r.bumper_travel) + " m");
}

}  // namespace

void check_robot(Check& check, const swe_robot_config& r, const swe_physics_config& physics) {
    bool sized = check.range("robot.radius", r.radius, 0.005, 1, "m");
    sized &= check.range("robot.height", r.height, 0.005, 2, "m");
    check.range("robot.mass", r.mass, 0.001, 100, "kg");
    sized &= check.range("robot.centre_of_mass", r.centre_of_mass, 0.001, 1, "m");
    sized &= check.range("robot.wheel_radius", r.wheel_radius, 0.001, 1, "m");
    sized &= check.range("robot.axle_length", r.axle_length, 0.005, 2, "m");
    check.range("robot.top_speed", r.top_speed, 0.01, 1000, "rad/s");
    check.range("robot.motor_torque", r.motor_torque, 1e-6, 100, "N m");
    sized &= check.range("robot.caster_offset", r.caster_offset, 0.001, 1, "m");
    sized &= check.range("robot.caster_clearance", r.caster_clearance, 0, 0.01, "m");
    check_bumper(check, r);
    if (!sized) return;
    check_robot_shape(check, r);
    check_centre_of_mass(check, r, physics);
}

}  // namespace swarmevo

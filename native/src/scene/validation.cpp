// SPDX-License-Identifier: BSD-3-Clause
#include "scene/validation.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "epuck.hpp"
#include "error.hpp"
#include "scene/check.hpp"

namespace swarmevo {
namespace {

constexpr double kLargestControlSteps = 1e7;

// Its friction with the floor must not turn a sliding box over.
void check_box_slides(Check& check, const swe_scene_config& c) {
    const double highest = std::min(c.box.size[0], c.box.size[1]) / c.physics.box_friction;
    if (c.physics.box_friction > 0 && c.box.size[2] > highest)
        check.fail("box.size: expected a box that slides before it tips, at most " + number(highest) +
                   " m high (its shorter side over physics.box_friction), got " + number(c.box.size[2]) + " m");
}

void check_world(Check& check, const swe_scene_config& c) {
    check.range("arena.size", c.arena.size, 0.2, 100, "m");
    check.range("arena.wall_height", c.arena.wall_height, 0.005, 1, "m");
    check.choice("arena.target_wall", c.arena.target_wall, SWE_TARGET_WALL_WEST);

    if (check.ranges("box.size", c.box.size, 0.01, 10, "m")) check_box_slides(check, c);
    check.range("box.mass", c.box.mass, 0.001, 1000, "kg");
    check.ranges("box.pose", c.box.pose, -100, 100, "");
    check.ranges("box.velocity", c.box.velocity, -10, 10, "");

    check.ranges("emitter.position", c.emitter.position, -100, 100, "m");
    check.range("emitter.range", c.emitter.range, 0.01, 1000, "m");
    if (check.ranges("emitter.strength", c.emitter.strength, 0, 1e6, "") &&
        !(c.emitter.strength[0] < c.emitter.strength[1]))
        check.fail("emitter.strength: expected the smaller value first, got " + number(c.emitter.strength[0]) + ", " +
                   number(c.emitter.strength[1]));
    check.choice("emitter.reach", c.emitter.reach, SWE_REACH_ARENA);
}

// Up to it the articulated drive turns and slides the box as a simulator from outside does (docs/validation.md) [s].
constexpr double kLongestArticulatedStep = 0.004;

// Steps of first order: they are true if they are small, and do not resolve the blow of a rigid bumper.
void check_articulated(Check& check, const swe_scene_config& c) {
    if (c.physics.time_step > kLongestArticulatedStep)
        check.fail("physics.time_step: expected at most " + number(kLongestArticulatedStep) +
                   " s with the articulated drive, which is true at small steps only, got " +
                   number(c.physics.time_step) + " s: set 0.004");
    if (c.robot.bumper == SWE_BUMPER_RIGID)
        check.fail(
            "robot.bumper: expected sprung with the articulated drive, which does not resolve a rigid blow, got "
            "rigid: set sprung, or physics.drive to driven_contacts");
}

// Contacts are laid out at the start of a step: bodies may not move far in it.
void check_way(Check& check, const swe_scene_config& c) {
    const double way = rim_speed(c.robot, 1, c.noise.wheels) * c.physics.time_step, longest = c.robot.radius / 3;
    if (way > longest)
        check.fail("robot.top_speed: expected a way of at most a third of robot.radius in a physics.time_step (" +
                   number(longest) + " m), got " + number(way) + " m: reduce either");
}

// Contacts give way in proportion to their force: of all robots that press, of the heaviest body that is stopped.
void check_softness(Check& check, const swe_scene_config& c) {
    constexpr double kDeepest = 1e-3;  // [m]
    const double speed =
        std::max(rim_speed(c.robot, 1, c.noise.wheels), std::hypot(c.box.velocity[0], c.box.velocity[1]));
    const double press = c.team.robots * c.physics.wheel_friction * c.robot.mass * c.physics.gravity *
                         c.physics.time_step / c.physics.contact_erp;
    const double impact = std::max(c.box.mass, c.robot.mass) * speed;
    const double softest = kDeepest / std::max(press, impact);
    if (c.physics.contact_cfm > softest)
        check.fail("physics.contact_cfm: expected at most " + number(softest) +
                   " s/kg, or bodies as heavy and as fast as these overlap by more than a millimetre, got " +
                   number(c.physics.contact_cfm) + " s/kg");
}

void check_physics(Check& check, const swe_scene_config& c) {
    check.range("noise.infrared", c.noise.infrared, 0, 1, "");
    check.range("noise.infrared_at_contact", c.noise.infrared_at_contact, 0, 1, "");
    check.range("noise.wheels", c.noise.wheels, 0, 1, "");
    check.range("noise.rf", c.noise.rf, 0, 1, "");

    const bool stepped = check.range("physics.time_step", c.physics.time_step, 0.0005, 0.05, "s");
    check.range("physics.gravity", c.physics.gravity, 0.1, 100, "m/s^2");
    check.range("physics.wheel_friction", c.physics.wheel_friction, 0, 10, "");
    check.range("physics.box_friction", c.physics.box_friction, 0, 10, "");
    check.range("physics.side_friction", c.physics.side_friction, 0, 10, "");
    check.range("physics.contact_erp", c.physics.contact_erp, 0.01, 1, "");
    check.range("physics.contact_cfm", c.physics.contact_cfm, 1e-9, 0.1, "s/kg");

    check_way(check, c);
    check_softness(check, c);
    check.choice("physics.drive", c.physics.drive, SWE_DRIVE_ARTICULATED);
    if (stepped && c.physics.drive == SWE_DRIVE_ARTICULATED) check_articulated(check, c);

    const bool lasting = check.range("episode.horizon", c.episode.horizon, 0.001, 1e5, "s");
    check.choice("episode.until", c.episode.until, SWE_UNTIL_PUSH);
    const bool periodic = check.range("episode.control_period", c.episode.control_period, 0.0005, 10, "s");
    if (stepped && periodic)
        check.multiple("episode.control_period", c.episode.control_period, "time steps", c.physics.time_step);
    if (lasting && periodic) {
        check.multiple("episode.horizon", c.episode.horizon, "control periods", c.episode.control_period);
        if (c.episode.horizon / c.episode.control_period > kLargestControlSteps)
            check.fail("episode.horizon: expected at most " + number(kLargestControlSteps) + " control periods, got " +
                       number(c.episode.horizon / c.episode.control_period));
    }
}

}  // namespace

const swe_scene_config& checked(const swe_scene_config& c) {
    Check check;
    if (c.struct_size != sizeof(swe_scene_config))
        throw Error(SWE_INVALID_ARGUMENT, "swe_scene_config.struct_size: expected " +
                                              std::to_string(sizeof(swe_scene_config)) + ", got " +
                                              std::to_string(c.struct_size) + ": library and caller differ in version");
    check_world(check, c);
    check_robot(check, c.robot, c.physics);
    check_sensors(check, c);
    check_physics(check, c);
    check_team(check, c, check.passed());
    if (!check.passed()) throw Error(SWE_INVALID_ARGUMENT, check.errors());
    return c;
}

}  // namespace swarmevo

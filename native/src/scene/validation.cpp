// SPDX-License-Identifier: BSD-3-Clause
#include "scene/validation.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "epuck.hpp"
#include "error.hpp"
#include "scene/check.hpp"
#include "scene/scene.hpp"

namespace swarmevo {
namespace {

constexpr double kLargestControlSteps = 1e7;

void check_arena(Check& check, const swe_arena_config& a) {
    check.range("arena.wall_height", a.wall_height, 0.005, 1, "m");
    check.choice("arena.shape", a.shape, SWE_ARENA_SHAPE_POLYGON);
    if (a.shape != SWE_ARENA_SHAPE_POLYGON) {
        check.ranges("arena.size", a.size, 0.2, 100, "m");
        return;
    }
    if (!check.range("arena.corners: their number", a.n_corners, 3, SWE_MAX_CORNERS, "")) return;
    bool good = true;
    for (unsigned i = 0; i < a.n_corners; ++i)
        good &= check.ranges("arena.corners[" + std::to_string(i) + "]", a.corners[i], -100, 100, "m");
    double turned = 0;  // once round, all to the left
    for (unsigned i = 0; good && i < a.n_corners; ++i) {
        const double *from = a.corners[i], *at = a.corners[(i + 1) % a.n_corners],
                     *to = a.corners[(i + 2) % a.n_corners];
        const double ax = at[0] - from[0], ay = at[1] - from[1], bx = to[0] - at[0], by = to[1] - at[1];
        const double turn = std::atan2(ax * by - ay * bx, ax * bx + ay * by);
        turned += turn;
        good = std::hypot(ax, ay) >= 0.01 && turn > 1e-3 && turn < 3.1;
        if (!good)
            check.fail("arena.corners[" + std::to_string((i + 1) % a.n_corners) +
                       "]: expected corners at least 0.01 m apart, counter-clockwise, of a convex polygon, got one at "
                       "which it does not turn left");
    }
    if (good && std::abs(turned - 2 * kPi) > 0.1)
        check.fail("arena.corners: expected a polygon that goes round once, got one that crosses itself");
}

// Its friction with the floor must not turn a sliding box over.
void check_slides(Check& check, const std::string& name, const swe_movable_config& m) {
    const double highest = m.feet * std::min(m.size[0], m.size[1]) / m.friction;
    if (m.friction > 0 && m.size[2] > highest)
        check.fail(name + ".size: expected one that slides before it tips, at most " + number(highest) +
                   " m high (its shorter side by " + name + ".feet, over .friction), got " + number(m.size[2]) + " m");
}

void check_size(Check& check, const std::string& name, std::int32_t shape, const double (&size)[3]) {
    check.choice(name + ".shape", shape, SWE_SHAPE_CYLINDER);
    check.ranges(name + ".size", size, 0.01, 10, "m");
    if (shape == SWE_SHAPE_CYLINDER && size[0] != size[1])
        check.fail(name + ".size: expected a cylinder's diameter twice, got " + number(size[0]) + ", " +
                   number(size[1]) + " m");
}

void check_movable(Check& check, const std::string& name, const swe_movable_config& m) {
    const bool before = check.passed();
    check_size(check, name, m.shape, m.size);
    check.range(name + ".mass", m.mass, 0.001, 1000, "kg");
    check.range(name + ".friction", m.friction, 0, 10, "");
    check.range(name + ".feet", m.feet, 0.1, 1, "of the way to the corners");
    check.ranges(name + ".velocity", m.velocity, -10, 10, "");
    check.choice(name + ".start", m.start, SWE_START_RANDOM);
    if (m.start == SWE_START_RANDOM)
        check.ranges(name + ".start_region", m.start_region, -100, 100, "m");
    else
        check.ranges(name + ".pose", m.pose, -100, 100, "");
    if (before && check.passed()) check_slides(check, name, m);
}

void check_emitter(Check& check, const std::string& name, const swe_emitter_config& e, unsigned movables) {
    check.range(name + ".channel", e.channel, 0, SWE_CHANNEL_LIGHT, "");
    if (e.rides_on != SWE_NOTHING && (e.rides_on < 0 || e.rides_on >= static_cast<std::int64_t>(movables)))
        check.fail(name + ".rides_on: expected one of the " + std::to_string(movables) + " movables, got " +
                   number(e.rides_on));
    check.ranges(name + ".position", e.position, -100, 100, "m");
    check.range(name + ".range", e.range, 0.01, 1000, "m");
    if (check.ranges(name + ".strength", e.strength, 0, 1e6, "") && !(e.strength[0] < e.strength[1]))
        check.fail(name + ".strength: expected the smaller value first, got " + number(e.strength[0]) + ", " +
                   number(e.strength[1]));
    check.choice(name + ".reach", e.reach, SWE_REACH_ARENA);
}

void check_ground(Check& check, const swe_ground_config& ground) {
    check.range("ground.grey", ground.grey, 0, 1, "");
    if (!check.range("ground.patches: their number", ground.n_patches, 0, SWE_MAX_PATCHES, "")) return;
    for (unsigned i = 0; i < ground.n_patches; ++i) {
        const std::string name = "ground.patches[" + std::to_string(i) + "]";
        check.choice(name + ".shape", ground.patches[i].shape, SWE_SHAPE_CYLINDER);
        const double* size = ground.patches[i].size;
        if (check.ranges(name + ".size", ground.patches[i].size, 0.001, 1000, "m") &&
            ground.patches[i].shape == SWE_SHAPE_CYLINDER && size[0] != size[1])
            check.fail(name + ".size: expected a disc's diameter twice, got " + number(size[0]) + ", " +
                       number(size[1]));
        check.ranges(name + ".pose", ground.patches[i].pose, -100, 100, "");
        check.range(name + ".grey", ground.patches[i].grey, 0, 1, "");
    }
}

void check_goal(Check& check, const std::string& name, const swe_goal_config& goal, const swe_arena_config& arena) {
    check.choice(name, goal.kind, SWE_GOAL_REGION);
    if (goal.kind != SWE_GOAL_REGION) {
        if (arena.shape != SWE_ARENA_SHAPE_RECTANGLE)
            check.fail(name +
                       ": expected a region, for only a rectangular arena has walls to the north, south, east "
                       "and west, got a wall");
        return;
    }
    if (check.ranges(name + ".region", goal.region, -100, 100, "m") &&
        !(goal.region[0] < goal.region[1] && goal.region[2] < goal.region[3]))
        check.fail(name + ".region: expected x from < x to and y from < y to, got " + number(goal.region[0]) + ", " +
                   number(goal.region[1]) + ", " + number(goal.region[2]) + ", " + number(goal.region[3]));
}

void check_world(Check& check, const swe_scene_config& c) {
    check_arena(check, c.arena);
    bool counted = check.range("movables: their number", c.n_movables, 0, SWE_MAX_MOVABLES, "");
    for (unsigned i = 0; counted && i < c.n_movables; ++i)
        check_movable(check, "movables[" + std::to_string(i) + "]", c.movables[i]);
    if (check.range("obstacles: their number", c.n_obstacles, 0, SWE_MAX_OBSTACLES, ""))
        for (unsigned i = 0; i < c.n_obstacles; ++i) {
            const std::string name = "obstacles[" + std::to_string(i) + "]";
            check_size(check, name, c.obstacles[i].shape, c.obstacles[i].size);
            check.ranges(name + ".pose", c.obstacles[i].pose, -100, 100, "");
        }
    if (counted && check.range("emitters: their number", c.n_emitters, 0, SWE_MAX_EMITTERS, ""))
        for (unsigned i = 0; i < c.n_emitters; ++i)
            check_emitter(check, "emitters[" + std::to_string(i) + "]", c.emitters[i], c.n_movables);
    check_ground(check, c.ground);
    if (check.range("goals: their number", c.n_goals, 0, SWE_MAX_GOALS, ""))
        for (unsigned i = 0; i < c.n_goals; ++i)
            check_goal(check, "goals[" + std::to_string(i) + "]", c.goals[i], c.arena);
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
    double speed = rim_speed(c.robot, 1, c.noise.wheels), heaviest = c.robot.mass;
    for (unsigned i = 0; i < std::min<unsigned>(c.n_movables, SWE_MAX_MOVABLES); ++i) {
        speed = std::max(speed, std::hypot(c.movables[i].velocity[0], c.movables[i].velocity[1]));
        heaviest = std::max(heaviest, c.movables[i].mass);
    }
    const double press = c.team.robots * c.physics.wheel_friction * c.robot.mass * c.physics.gravity *
                         c.physics.time_step / c.physics.contact_erp;
    const double impact = heaviest * speed;
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
    check.range("noise.rf_bearing", c.noise.rf_bearing, 0, 3.15, "rad");
    check.range("noise.range_and_bearing", c.noise.range_and_bearing, 0, 1, "");
    check.range("noise.ground", c.noise.ground, 0, 1, "");
    check.range("noise.odometry", c.noise.odometry, 0, 1, "");
    check.range("noise.light", c.noise.light, 0, 1, "");

    const bool stepped = check.range("physics.time_step", c.physics.time_step, 0.0005, 0.05, "s");
    check.range("physics.gravity", c.physics.gravity, 0.1, 100, "m/s^2");
    check.range("physics.wheel_friction", c.physics.wheel_friction, 0, 10, "");
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

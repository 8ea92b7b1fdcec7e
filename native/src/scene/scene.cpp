// SPDX-License-Identifier: BSD-3-Clause
#include "scene/scene.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "epuck.hpp"
#include "error.hpp"

namespace swarmevo {
namespace {

constexpr double kLargestControlSteps = 1e7;
// Random sequential placement of discs jams at a density of 0.547; well below it, and where no more than nine in ten
// places are the box's, drawing finds a place quickly.
constexpr double kDensestRandomStart = 0.35, kLeastFreeShare = 0.1;
// Share of a region that is enough for drawing a place for the last robot.
constexpr double kLeastLeftShare = 0.01;
// Largest slope of a robot that leans on a caster: the sides of bodies are taken to be upright.
constexpr double kSteepestLean = 0.1;

std::string number(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.10g", value);
    return text;
}

// Collects every error of a config.
class Check {
  public:
    void fail(const std::string& message) { errors_ += (errors_.empty() ? "" : "; ") + message; }

    bool range(const std::string& field, double value, double low, double high, const char* unit) {
        if (value >= low && value <= high) return true;  // false for NaN
        const std::string came = std::isnan(value) ? "not a number (not set?)" : number(value);
        const std::string space = *unit ? " " : "";
        fail(field + ": expected " + number(low) + " to " + number(high) + space + unit + ", got " + came);
        return false;
    }

    template <std::size_t n>
    bool ranges(const std::string& field, const double (&values)[n], double low, double high, const char* unit) {
        bool good = true;
        for (std::size_t i = 0; i < n; ++i)
            good &= range(field + "[" + std::to_string(i) + "]", values[i], low, high, unit);
        return good;
    }

    void choice(const std::string& field, int value, int last) {
        if (value < 1 || value > last)
            fail(field + ": not set, or not one of its SWE_ constants (" + number(value) + ")");
    }

    // Is `whole` a positive multiple of `part`?
    void multiple(const std::string& field, double whole, const char* part_name, double part) {
        const double ratio = whole / part, nearest = std::round(ratio);
        if (nearest < 1 || std::abs(ratio - nearest) > 1e-6)
            fail(field + ": expected a whole number of " + part_name + " (" + number(part) + " s), got " +
                 number(whole) + " s");
    }

    bool passed() const { return errors_.empty(); }
    const std::string& errors() const { return errors_; }

  private:
    std::string errors_;
};

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

void check_sensors(Check& check, const swe_sensors_config& s) {
    check.ranges("sensors.infrared_yaw_deg", s.infrared_yaw_deg, -360, 360, "deg");
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
    check.ranges("sensors.touch_yaw_deg", s.touch_yaw_deg, -360, 360, "deg");
    check.range("sensors.touch_half_width_deg", s.touch_half_width_deg, 0.1, 180, "deg");
    check.range("sensors.touch_range", s.touch_range, 0.0001, 10, "m");
    check.choice("sensors.touch_mode", s.touch_mode, SWE_TOUCH_MODE_FORCE);
}

// Above it three robots at a slant no longer push the box (docs/validation.md) [s].
constexpr double kLongestArticulatedStep = 0.02;

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
    const double blow = std::max(c.box.mass, c.robot.mass) * speed;
    const double softest = kDeepest / std::max(press, blow);
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
    if (stepped && c.physics.drive == SWE_DRIVE_ARTICULATED && c.physics.time_step > kLongestArticulatedStep)
        check.fail("physics.time_step: expected at most " + number(kLongestArticulatedStep) +
                   " s with the articulated drive, which is true at small steps only, got " +
                   number(c.physics.time_step) + " s: set 0.005");

    const bool lasting = check.range("episode.horizon", c.episode.horizon, 0.001, 1e5, "s");
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

// Half the width of the arena that a rectangle needs along x and y when turned by its heading.
Pose half_extent(const swe_box_config& box) {
    const double cosine = std::abs(std::cos(box.pose[2])), sine = std::abs(std::sin(box.pose[2]));
    return {(box.size[0] * cosine + box.size[1] * sine) / 2, (box.size[0] * sine + box.size[1] * cosine) / 2, 0};
}

void check_box_place(Check& check, const swe_scene_config& c) {
    const Pose half = half_extent(c.box);
    const double room_x = c.arena.size / 2 - half.x, room_y = c.arena.size / 2 - half.y;
    if (std::min(room_x, room_y) < 0)
        check.fail("box.size: expected a box that fits into the arena at its heading (" + number(c.arena.size) +
                   " m), got one that takes " + number(2 * half.x) + " by " + number(2 * half.y) + " m");
    else if (std::abs(c.box.pose[0]) > room_x || std::abs(c.box.pose[1]) > room_y)
        check.fail("box.pose: expected the box inside the arena (centre within +-" + number(room_x) + ", +-" +
                   number(room_y) + " m), got " + number(c.box.pose[0]) + ", " + number(c.box.pose[1]) + " m");
}

// Distance of a point from the box [m].
double box_distance(const swe_scene_config& c, double x, double y) {
    const double cosine = std::cos(c.box.pose[2]), sine = std::sin(c.box.pose[2]);
    const double dx = x - c.box.pose[0], dy = y - c.box.pose[1];
    return separate_point_from_rectangle(cosine * dx + sine * dy, cosine * dy - sine * dx, c.box.size[0] / 2,
                                         c.box.size[1] / 2)
        .distance;
}

// A robot disturbed as far as the jitter allows must still stand free of walls, box and neighbours.
void check_start_poses(Check& check, const swe_scene_config& c) {
    const double jitter = std::sqrt(2.0) * c.team.start_jitter[0], room = c.arena.size / 2 - c.robot.radius;
    for (unsigned i = 0; i < c.team.robots; ++i) {
        const double* pose = c.team.start_poses + 3 * i;
        const std::string name = "team.start_poses[" + std::to_string(i) + "]";
        if (!(std::isfinite(pose[0]) && std::isfinite(pose[1]) && std::isfinite(pose[2]))) {
            check.fail(name + ": expected three numbers, got not a number");
            continue;
        }
        const std::string at = number(pose[0]) + ", " + number(pose[1]) + " m";
        if (std::max(std::abs(pose[0]), std::abs(pose[1])) + c.team.start_jitter[0] > room)
            check.fail(name + ": expected the robot inside the arena with its jitter (within +-" +
                       number(room - c.team.start_jitter[0]) + " m), got " + at);
        const double to_box = box_distance(c, pose[0], pose[1]);
        if (to_box < c.robot.radius + jitter)
            check.fail(name + ": expected the robot clear of the box with its jitter (" +
                       number(c.robot.radius + jitter) + " m from it), got " + number(to_box) + " m");
        for (unsigned j = 0; j < i; ++j) {
            const double* other = c.team.start_poses + 3 * j;
            const double distance = std::hypot(pose[0] - other[0], pose[1] - other[1]);
            const double needed = 2 * c.robot.radius + 2 * jitter;
            if (distance < needed)
                check.fail(name + ": expected at least " + number(needed) + " m to robot " + std::to_string(j) +
                           " (two radii and their jitter), got " + number(distance) + " m");
        }
    }
}

// Share of the start region in which a robot's centre is clear of the box, by a grid of points.
double free_share(const swe_scene_config& c) {
    constexpr int kPoints = 128;  // in either direction
    const double* region = c.team.start_region;
    const double dx = (region[1] - region[0]) / kPoints, dy = (region[3] - region[2]) / kPoints;
    int free = 0;
    for (int i = 0; i < kPoints; ++i)
        for (int j = 0; j < kPoints; ++j)
            free += box_distance(c, region[0] + (i + 0.5) * dx, region[2] + (j + 0.5) * dy) > c.robot.radius;
    return free / static_cast<double>(kPoints * kPoints);
}

void check_start_region(Check& check, const swe_scene_config& c) {
    const double room = c.arena.size / 2 - c.robot.radius;
    const double* region = c.team.start_region;
    if (!check.ranges("team.start_region", c.team.start_region, -room, room, "m (inside the arena)")) return;
    if (!(region[0] < region[1] && region[2] < region[3])) {
        check.fail("team.start_region: expected x from < x to and y from < y to, got " + number(region[0]) + ", " +
                   number(region[1]) + ", " + number(region[2]) + ", " + number(region[3]));
        return;
    }
    const double area = (region[1] - region[0]) * (region[3] - region[2]), share = free_share(c);
    const double disc = kPi * c.robot.radius * c.robot.radius;
    // Each of the others keeps a centre at two radii from its own: four discs at most.
    const bool always_leaves_room = share * area - (c.team.robots - 1) * 4 * disc >= kLeastLeftShare * area;
    const bool is_sparse = share >= kLeastFreeShare && c.team.robots * disc <= kDensestRandomStart * share * area;
    if (!always_leaves_room && !is_sparse)
        check.fail("team.start_region: expected a place for each of " + std::to_string(c.team.robots) +
                   " robots, clear of the box and of each other, got " + number(share * area) +
                   " m^2 for their centres: enlarge it or move it away from the box");
}

void check_team(Check& check, const swe_scene_config& c, bool world_is_sound) {
    const swe_team_config& t = c.team;
    bool sound = check.range("team.robots", t.robots, 1, SWE_MAX_ROBOTS, "robots");
    sound &= check.range("team.start_jitter[0]", t.start_jitter[0], 0, 1, "m");
    sound &= check.range("team.start_jitter[1]", t.start_jitter[1], 0, 3.15, "rad");
    check.choice("team.start", t.start, SWE_START_RANDOM);
    if (t.start == SWE_START_POSES && !t.start_poses) {
        check.fail("team.start_poses: expected one pose for each robot, got none");
        return;
    }
    if (!sound || !world_is_sound) return;
    if (c.robot.radius > c.arena.size / 2) {
        check.fail("robot.radius: expected at most half of arena.size (" + number(c.arena.size / 2) + " m), got " +
                   number(c.robot.radius) + " m");
        return;
    }
    check_box_place(check, c);
    if (t.start == SWE_START_POSES) check_start_poses(check, c);
    if (t.start == SWE_START_RANDOM) check_start_region(check, c);
}

const swe_scene_config& checked(const swe_scene_config& c) {
    Check check;
    if (c.struct_size != sizeof(swe_scene_config))
        throw Error(SWE_INVALID_ARGUMENT, "swe_scene_config.struct_size: expected " +
                                              std::to_string(sizeof(swe_scene_config)) + ", got " +
                                              std::to_string(c.struct_size) + ": library and caller differ in version");
    check_world(check, c);
    check_robot(check, c.robot, c.physics);
    check_sensors(check, c.sensors);
    check_physics(check, c);
    check_team(check, c, check.passed());
    if (!check.passed()) throw Error(SWE_INVALID_ARGUMENT, check.errors());
    return c;
}

std::vector<Pose> copy_poses(const swe_team_config& team) {
    std::vector<Pose> poses;
    if (team.start == SWE_START_POSES)
        for (unsigned i = 0; i < team.robots; ++i)
            poses.push_back({team.start_poses[3 * i], team.start_poses[3 * i + 1], team.start_poses[3 * i + 2]});
    return poses;
}

std::array<Scene::Direction, SWE_INFRARED_SENSORS> directions(const double (&yaw_deg)[SWE_INFRARED_SENSORS]) {
    std::array<Scene::Direction, SWE_INFRARED_SENSORS> rays;
    for (std::size_t i = 0; i < rays.size(); ++i)
        rays[i] = {std::cos(yaw_deg[i] * kRadiansPerDegree), std::sin(yaw_deg[i] * kRadiansPerDegree)};
    return rays;
}

unsigned ratio(double whole, double part) {
    return static_cast<unsigned>(std::lround(whole / part));
}

}  // namespace

Scene::Scene(const swe_scene_config& config)
    : arena(checked(config).arena),
      box(config.box),
      emitter(config.emitter),
      robot(config.robot),
      team(config.team),
      sensors(config.sensors),
      noise(config.noise),
      physics(config.physics),
      episode(config.episode),
      start_poses(copy_poses(config.team)),
      infrared_rays(directions(config.sensors.infrared_yaw_deg)),
      robots(config.team.robots),
      control_steps(ratio(config.episode.horizon, config.episode.control_period)),
      substeps(ratio(config.episode.control_period, config.physics.time_step)) {}

Separation separate_point_from_rectangle(double x, double y, double half_x, double half_y) {
    const double nearest_x = std::clamp(x, -half_x, half_x), nearest_y = std::clamp(y, -half_y, half_y);
    const double dx = x - nearest_x, dy = y - nearest_y;
    const double distance = std::sqrt(dx * dx + dy * dy);
    if (distance > 0) return {distance, nearest_x, nearest_y, dx / distance, dy / distance};
    // Inside: the shortest way out leads through the nearest edge.
    const double depth_x = half_x - std::abs(x), depth_y = half_y - std::abs(y);
    if (depth_x < depth_y) return {-depth_x, std::copysign(half_x, x), y, std::copysign(1.0, x), 0};
    return {-depth_y, x, std::copysign(half_y, y), 0, std::copysign(1.0, y)};
}

}  // namespace swarmevo

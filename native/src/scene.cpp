// SPDX-License-Identifier: BSD-3-Clause
#include "scene.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "error.hpp"

namespace swarmevo {
namespace {

constexpr double kLargestControlSteps = 1e7;
// Random sequential placement of discs jams at a density of 0.547; well below it, drawing finds a place quickly.
constexpr double kDensestRandomStart = 0.35;

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

void check_world(Check& check, const swe_scene_config& c) {
    check.range("arena.size", c.arena.size, 0.2, 100, "m");
    check.range("arena.wall_height", c.arena.wall_height, 0.005, 1, "m");
    check.choice("arena.target_wall", c.arena.target_wall, SWE_TARGET_WALL_WEST);

    check.ranges("box.size", c.box.size, 0.01, 10, "m");
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

void check_robot(Check& check, const swe_robot_config& r) {
    bool sized = check.range("robot.radius", r.radius, 0.005, 1, "m");
    sized &= check.range("robot.height", r.height, 0.005, 2, "m");
    check.range("robot.mass", r.mass, 0.001, 100, "kg");
    sized &= check.range("robot.centre_of_mass", r.centre_of_mass, 0.001, 1, "m");
    check.range("robot.wheel_radius", r.wheel_radius, 0.001, 1, "m");
    sized &= check.range("robot.axle_length", r.axle_length, 0.005, 2, "m");
    check.range("robot.top_speed", r.top_speed, 0.01, 1000, "rad/s");
    check.range("robot.motor_torque", r.motor_torque, 1e-6, 100, "N m");
    sized &= check.range("robot.caster_offset", r.caster_offset, 0.001, 1, "m");
    check.range("robot.caster_clearance", r.caster_clearance, 0, 0.01, "m");
    if (!sized) return;
    if (r.centre_of_mass >= r.height)
        check.fail("robot.centre_of_mass: expected less than robot.height (" + number(r.height) + " m), got " +
                   number(r.centre_of_mass) + " m");
    if (r.axle_length > 2 * r.radius)
        check.fail("robot.axle_length: expected at most twice robot.radius (" + number(2 * r.radius) + " m), got " +
                   number(r.axle_length) + " m");
    if (r.caster_offset > r.radius)
        check.fail("robot.caster_offset: expected at most robot.radius (" + number(r.radius) + " m), got " +
                   number(r.caster_offset) + " m");
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

    check.choice("physics.drive", c.physics.drive, SWE_DRIVE_ARTICULATED);

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
    if (std::abs(c.box.pose[0]) > room_x || std::abs(c.box.pose[1]) > room_y)
        check.fail("box.pose: expected the box inside the arena (centre within +-" + number(room_x) + ", +-" +
                   number(room_y) + " m), got " + number(c.box.pose[0]) + ", " + number(c.box.pose[1]) + " m");
}

// A robot disturbed as far as the jitter allows must still stand free of walls, box and neighbours.
void check_start_poses(Check& check, const swe_scene_config& c) {
    const double jitter = std::sqrt(2.0) * c.team.start_jitter[0], room = c.arena.size / 2 - c.robot.radius;
    const double cosine = std::cos(c.box.pose[2]), sine = std::sin(c.box.pose[2]);
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
        const double dx = pose[0] - c.box.pose[0], dy = pose[1] - c.box.pose[1];
        const Separation box = separate_point_from_rectangle(cosine * dx + sine * dy, cosine * dy - sine * dx,
                                                             c.box.size[0] / 2, c.box.size[1] / 2);
        if (box.distance < c.robot.radius + jitter)
            check.fail(name + ": expected the robot clear of the box with its jitter (" +
                       number(c.robot.radius + jitter) + " m from it), got " + number(box.distance) + " m");
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

void check_start_region(Check& check, const swe_scene_config& c) {
    const double room = c.arena.size / 2 - c.robot.radius;
    const double* region = c.team.start_region;
    if (!check.ranges("team.start_region", c.team.start_region, -room, room, "m (inside the arena)")) return;
    if (!(region[0] < region[1] && region[2] < region[3])) {
        check.fail("team.start_region: expected x from < x to and y from < y to, got " + number(region[0]) + ", " +
                   number(region[1]) + ", " + number(region[2]) + ", " + number(region[3]));
        return;
    }
    const double area = (region[1] - region[0]) * (region[3] - region[2]) - c.box.size[0] * c.box.size[1];
    const double discs = c.team.robots * kPi * c.robot.radius * c.robot.radius;
    if (discs > kDensestRandomStart * area)
        check.fail("team.start_region: expected room for " + std::to_string(c.team.robots) +
                   " robots (at most 35 % of the floor beside the box), got " + number(area) + " m^2");
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
    check_robot(check, c.robot);
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

// SPDX-License-Identifier: BSD-3-Clause
// Whether movables and robots have room where they start.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "scene/check.hpp"
#include "scene/scene.hpp"

namespace swarmevo {
namespace {

// Random sequential placement of discs jams at a density of 0.547; well below it, and where no more than nine in ten
// places are taken, drawing finds a place quickly.
constexpr double kDensestRandomStart = 0.35, kLeastFreeShare = 0.1;
// Share of a region that is enough for drawing a place for the last robot.
constexpr double kLeastLeftShare = 0.01;

// What stands on the floor at the start, with its name in messages.
struct Standing {
    std::string name;
    Figure figure;
    Pose pose;
    bool is_movable;
};

std::vector<Standing> all_standing(const swe_scene_config& c) {
    std::vector<Standing> all;
    for (unsigned i = 0; i < c.n_movables; ++i) {
        const swe_movable_config& m = c.movables[i];
        if (m.start != SWE_START_RANDOM)
            all.push_back({"movables[" + std::to_string(i) + "]",
                           Figure::of(m.shape, m.size[0], m.size[1], m.size[2]),
                           {m.pose[0], m.pose[1], m.pose[2]},
                           true});
    }
    for (unsigned i = 0; i < c.n_obstacles; ++i) {
        const swe_obstacle_config& o = c.obstacles[i];
        all.push_back({"obstacles[" + std::to_string(i) + "]",
                       Figure::of(o.shape, o.size[0], o.size[1], o.size[2]),
                       {o.pose[0], o.pose[1], o.pose[2]},
                       false});
    }
    return all;
}

std::string place(double x, double y) {
    return number(x) + ", " + number(y) + " m";
}

// Distance of a point from the nearest that stands [m]; infinity where nothing does.
double nearest_standing(const std::vector<Standing>& all, double x, double y) {
    double least = std::numeric_limits<double>::infinity();
    for (const Standing& one : all) least = std::min(least, distance(one.figure, one.pose, x, y));
    return least;
}

// Share of a region in which the centre of a disc is clear of walls and of all that stands, by a grid of points.
double free_share(const double* region, double radius, const Arena& arena, const std::vector<Standing>& all) {
    constexpr int kPoints = 128;  // in either direction
    const double dx = (region[1] - region[0]) / kPoints, dy = (region[3] - region[2]) / kPoints;
    int free = 0;
    for (int i = 0; i < kPoints; ++i)
        for (int j = 0; j < kPoints; ++j) {
            const double x = region[0] + (i + 0.5) * dx, y = region[2] + (j + 0.5) * dy;
            free += nearest_standing(all, x, y) > radius && arena.distance(x, y) >= radius;
        }
    return free / static_cast<double>(kPoints * kPoints);
}

// Is there a place for each of so many discs? `moving`: area that others who are drawn may take [m^2].
void check_region(Check& check, const std::string& name, const double (&region)[4], double radius, unsigned discs,
                  double moving, const Arena& arena, const std::vector<Standing>& all) {
    bool good = true;
    for (const int axis : {0, 1}) {
        const double low = arena.bounds()[2 * axis] + radius, high = arena.bounds()[2 * axis + 1] - radius;
        if (low > high) {
            check.fail(name + ": expected an arena in which a disc of " + number(2 * radius) + " m fits, got one of " +
                       number(high - low + 2 * radius) + " m");
            return;
        }
        for (const int i : {2 * axis, 2 * axis + 1})
            good &= check.range(name + "[" + std::to_string(i) + "]", region[i], low, high, "m (inside the arena)");
    }
    if (!good) return;
    if (!(region[0] < region[1] && region[2] < region[3])) {
        check.fail(name + ": expected x from < x to and y from < y to, got " + number(region[0]) + ", " +
                   number(region[1]) + ", " + number(region[2]) + ", " + number(region[3]));
        return;
    }
    const double area = (region[1] - region[0]) * (region[3] - region[2]);
    const double share = free_share(region, radius, arena, all), disc = kPi * radius * radius;
    const double free = share * area - moving;
    // Each of the others keeps a centre at two radii from its own: four discs at most.
    const bool always_leaves_room = free - (discs - 1) * 4 * disc >= kLeastLeftShare * area;
    const bool is_sparse = share >= kLeastFreeShare && discs * disc <= kDensestRandomStart * free;
    if (!always_leaves_room && !is_sparse)
        check.fail(name + ": expected a place for each of " + std::to_string(discs) +
                   ", clear of all that stands there" + (moving > 0 ? ", of movables that are drawn" : "") +
                   " and of each other, got " + number(std::max(0.0, free)) +
                   " m^2 for their centres: enlarge it or move it away");
}

// Area of centres that one disc keeps another from [m^2].
double kept_clear(double radius, double other) {
    return kPi * (radius + other) * (radius + other);
}

// The same of all movables that are drawn.
double moving_area(const swe_scene_config& c, double radius) {
    double area = 0;
    for (unsigned i = 0; i < c.n_movables; ++i) {
        const swe_movable_config& m = c.movables[i];
        if (m.start == SWE_START_RANDOM)
            area += kept_clear(radius, Figure::of(m.shape, m.size[0], m.size[1], m.size[2]).reach);
    }
    return area;
}

// Movables stand inside the arena, clear of each other and of obstacles, which may overlap each other and walls.
void check_standing(Check& check, const swe_scene_config& c, const Arena& arena, const std::vector<Standing>& all) {
    for (unsigned i = 0; i < all.size(); ++i) {
        const Standing& one = all[i];
        if (!one.is_movable) continue;
        const double room = arena.distance(one.figure, one.pose);
        if (room < 0)
            check.fail(one.name + ".pose: expected it inside the arena, with its size and heading, got " +
                       place(one.pose.x, one.pose.y) + ", where it lies " + number(-room) + " m beyond a wall");
        for (unsigned j = 0; j < all.size(); ++j) {
            if (j == i || (j < i && all[j].is_movable)) continue;
            const double gap = distance(one.figure, one.pose, all[j].figure, all[j].pose);
            if (gap < 0)
                check.fail(one.name + ".pose: expected it clear of " + all[j].name + ", got one that overlaps it");
        }
    }
    for (unsigned i = 0; i < c.n_movables; ++i) {
        const swe_movable_config& m = c.movables[i];
        if (m.start != SWE_START_RANDOM) continue;
        const Figure figure = Figure::of(m.shape, m.size[0], m.size[1], m.size[2]);
        check_region(check, "movables[" + std::to_string(i) + "].start_region", m.start_region, figure.reach, 1,
                     moving_area(c, figure.reach) - kept_clear(figure.reach, figure.reach), arena, all);
    }
}

// A robot disturbed as far as the jitter allows must still stand free of walls, movables, obstacles and neighbours.
void check_start_poses(Check& check, const swe_scene_config& c, const Arena& arena, const std::vector<Standing>& all) {
    const double jitter = std::sqrt(2.0) * c.team.start_jitter[0];
    for (unsigned i = 0; i < c.team.robots; ++i) {
        const double* pose = c.team.start_poses + 3 * i;
        const std::string name = "team.start_poses[" + std::to_string(i) + "]";
        if (!(std::isfinite(pose[0]) && std::isfinite(pose[1]) && std::isfinite(pose[2]))) {
            check.fail(name + ": expected three numbers, got not a number");
            continue;
        }
        const double needed = c.robot.radius + (!arena.walls().empty() ? c.team.start_jitter[0] : jitter);
        if (arena.distance(pose[0], pose[1]) < needed)
            check.fail(name + ": expected the robot inside the arena with its jitter (at least " + number(needed) +
                       " m from its walls), got " + place(pose[0], pose[1]));
        for (const Standing& one : all) {
            const double gap = distance(one.figure, one.pose, pose[0], pose[1]);
            if (gap < c.robot.radius + jitter)
                check.fail(name + ": expected the robot clear of " + one.name + " with its jitter (" +
                           number(c.robot.radius + jitter) + " m from it), got " + number(gap) + " m");
        }
        for (unsigned j = 0; j < i; ++j) {
            const double* other = c.team.start_poses + 3 * j;
            const double distance = std::hypot(pose[0] - other[0], pose[1] - other[1]);
            const double apart = 2 * c.robot.radius + 2 * jitter;
            if (distance < apart)
                check.fail(name + ": expected at least " + number(apart) + " m to robot " + std::to_string(j) +
                           " (two radii and their jitter), got " + number(distance) + " m");
        }
    }
}

}  // namespace

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
    const Arena arena(c.arena);
    if (arena.distance(0, 0) < c.robot.radius && c.arena.shape != SWE_ARENA_SHAPE_POLYGON) {
        check.fail("robot.radius: expected at most half of arena.size (" + number(arena.distance(0, 0)) + " m), got " +
                   number(c.robot.radius) + " m");
        return;
    }
    const std::vector<Standing> all = all_standing(c);
    check_standing(check, c, arena, all);
    if (t.start == SWE_START_POSES) check_start_poses(check, c, arena, all);
    if (t.start == SWE_START_RANDOM)
        check_region(check, "team.start_region", t.start_region, c.robot.radius, t.robots,
                     moving_area(c, c.robot.radius), arena, all);
}

}  // namespace swarmevo

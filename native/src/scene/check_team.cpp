// SPDX-License-Identifier: BSD-3-Clause
// Whether box and robots have room where they start.
#include <algorithm>
#include <cmath>
#include <string>

#include "scene/check.hpp"
#include "scene/scene.hpp"

namespace swarmevo {
namespace {

// Random sequential placement of discs jams at a density of 0.547; well below it, and where no more than nine in ten
// places are the box's, drawing finds a place quickly.
constexpr double kDensestRandomStart = 0.35, kLeastFreeShare = 0.1;
// Share of a region that is enough for drawing a place for the last robot.
constexpr double kLeastLeftShare = 0.01;

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
    if (c.robot.radius > c.arena.size / 2) {
        check.fail("robot.radius: expected at most half of arena.size (" + number(c.arena.size / 2) + " m), got " +
                   number(c.robot.radius) + " m");
        return;
    }
    check_box_place(check, c);
    if (t.start == SWE_START_POSES) check_start_poses(check, c);
    if (t.start == SWE_START_RANDOM) check_start_region(check, c);
}

}  // namespace swarmevo

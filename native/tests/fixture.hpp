// SPDX-License-Identifier: BSD-3-Clause
// The paper's world for the tests. Values are those of swarmevo/config/models.py, which
// tests/simulation/test_episodes.py compares them with.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "scene/scene.hpp"
#include "world/world.hpp"

namespace swarmevo {

#ifdef SWARMEVO_SANITIZED
inline constexpr unsigned kStride = 10;  // sanitizers are slow, and one of ten like cases shows what they find
#else
inline constexpr unsigned kStride = 1;
#endif

struct Fixture {
    std::vector<double> poses;  // (robots, 3)
    swe_scene_config config{};

    explicit Fixture(std::vector<double> start_poses = {-0.24, -0.4, -kPi / 2, -0.12, -0.4, -kPi / 2, 0, -0.4, -kPi / 2,
                                                        0.12, -0.4, -kPi / 2, 0.24, -0.4, -kPi / 2})
        : poses(std::move(start_poses)) {
        swe_scene_config_init(&config);
        config.arena.shape = SWE_ARENA_SHAPE_RECTANGLE;
        config.arena.size[0] = config.arena.size[1] = 1.0;
        config.arena.wall_height = 0.03;
        config.movables[0] = {SWE_SHAPE_BOX, {0.275, 0.18, 0.03}, 0.24, 0.62, 1, {0, 0.345, 0},
                              {0, 0, 0},     SWE_START_POSES,     {}};
        config.emitters[0] = {0, SWE_NOTHING, {0, 0.345, 0.03}, 0.3, {1, 50}, SWE_REACH_RANGE};
        config.goals[0] = {SWE_GOAL_NORTH, {}};
        config.n_movables = config.n_emitters = config.n_goals = 1;
        config.n_obstacles = config.ground.n_patches = 0;
        config.ground.grey = 1;
        config.robot = {0.035, 0.05, 0.08,   0.015, 0.0205, 0.053, 6.28,
                        0.02,  0.03, 0.0005, 100,   4.5,    0.012, SWE_BUMPER_SPRUNG,
                        {},    0};
        sense({SWE_SENSOR_INFRARED, SWE_SENSOR_TOUCH, SWE_SENSOR_RF});
        config.team.robots = static_cast<std::uint32_t>(poses.size() / 3);
        config.team.start = SWE_START_POSES;
        config.team.start_poses = poses.data();
        const double region[] = {-0.45, 0.45, -0.45, 0.15}, jitter[] = {0.01, 0.1};
        std::copy_n(region, 4, config.team.start_region);
        std::copy_n(jitter, 2, config.team.start_jitter);
        const double yaws[] = {-17.2, -45.9, -90, -151.5, 151.2, 90, 45.8, 17.1};
        std::copy_n(yaws, 8, config.sensors.infrared_yaw_deg);
        config.sensors.infrared_count = 8;
        const double curve[][2] = {{0, 4095},  {.005, 3474}, {.01, 2211}, {.02, 676}, {.03, 306},
                                   {.04, 164}, {.05, 90},    {.06, 56},   {.07, 34}};
        std::copy_n(&curve[0][0], 18, &config.sensors.infrared_curve[0][0]);
        config.sensors.infrared_curve_points = 9;
        config.sensors.infrared_target = SWE_INFRARED_TARGET_WALLS_AND_ROBOTS;
        const double touch[] = {45, 15, -15, -45};
        std::copy_n(touch, 4, config.sensors.touch_yaw_deg);
        config.sensors.touch_count = 4;
        config.sensors.touch_half_width_deg = 15;
        config.sensors.touch_range = 0.002;
        config.sensors.touch_mode = SWE_TOUCH_MODE_BINARY;
        config.sensors.range_and_bearing_range = 0.7;
        config.sensors.range_and_bearing_sectors = 4;
        config.sensors.range_and_bearing_message = 0;
        config.sensors.ground_position[0][0] = config.sensors.ground_position[0][1] = 0;
        config.sensors.ground_count = 1;
        config.sensors.light_sectors = 8;
        config.noise = {0.05, 0.005, 0.05, 0, 0, 0, 0, 0, 0};
        config.physics = {0.05, 9.81, 1.0, 0.2, 0.2, 1e-5, SWE_DRIVE_DRIVEN_CONTACTS};
        config.episode = {180, 0.1, SWE_UNTIL_HORIZON};
    }
    Fixture(const Fixture&) = delete;  // the config points into it

    // n robots side by side in front of the box's long face, heading north, 5 mm off it; the box far from the wall.
    static std::vector<double> aligned(int n) {
        std::vector<double> poses;
        for (int i = 0; i < n; ++i) {
            const double pose[] = {0.08 * (i - (n - 1) / 2.0), 0.07, kPi / 2};
            poses.insert(poses.end(), pose, pose + 3);
        }
        return poses;
    }

    Fixture& box_at(double x, double y, double heading = 0) {
        const double pose[] = {x, y, heading};
        std::copy_n(pose, 3, config.movables[0].pose);
        return *this;
    }

    Fixture& arena_of(double size) {
        config.arena.size[0] = config.arena.size[1] = size;
        return *this;
    }

    Fixture& without_noise() {
        config.noise = {};
        config.team.start_jitter[0] = config.team.start_jitter[1] = 0;
        return *this;
    }

    Fixture& sense(const std::vector<std::int32_t>& sensors) {
        std::copy(sensors.begin(), sensors.end(), config.robot.sensors);
        config.robot.sensor_count = static_cast<std::uint32_t>(sensors.size());
        return *this;
    }

    Scene scene() const { return Scene(config); }
};

// At the scene's poses, or robots at others.
inline Starts starts_of(const Scene& scene, const std::vector<Pose>& robots) {
    Starts starts{robots, {}};
    for (const auto& [config, figure] : scene.movables)
        starts.movables.push_back({config.pose[0], config.pose[1], config.pose[2]});
    return starts;
}
inline Starts starts_of(const Scene& scene) {
    return starts_of(scene, scene.start_poses);
}

inline void run(World& world, double seconds, double time_step) {
    for (long i = 0; i < std::lround(seconds / time_step); ++i) world.step();
}

// How far a ray from inside the arena goes to its walls [m].
inline double ray_to_arena(const Arena& arena, double x, double y, double dx, double dy) {
    if (arena.is_round()) return ray_to_ring(arena.round_radius(), x, y, dx, dy);
    double least = std::numeric_limits<double>::infinity();
    for (const Wall& wall : arena.walls()) least = std::min(least, ray_to_wall(wall, x, y, dx, dy));
    return least;
}

}  // namespace swarmevo

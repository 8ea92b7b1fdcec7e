// SPDX-License-Identifier: BSD-3-Clause
#include "episode.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "epuck.hpp"
#include "error.hpp"
#include "sensors/rf.hpp"

namespace swarmevo {
namespace {

constexpr double kNotYet = std::numeric_limits<double>::quiet_NaN();
constexpr double kTouchDistance = 0.002;  // between box and wall [m]
constexpr Pose kNowhere = {1e6, 1e6, 0};
constexpr unsigned kPlacementAttempts = 10000;  // for each robot
constexpr std::uint64_t kHashStart = 0xCBF29CE484222325u;

// Is a disc round (x, y) clear of walls, obstacles and all that was placed?
bool is_free(const Scene& scene, const Starts& placed, double x, double y, double radius) {
    for (const Pose& other : placed.robots)
        if (std::hypot(x - other.x, y - other.y) < scene.robot.radius + radius) return false;
    for (std::size_t i = 0; i < placed.movables.size(); ++i)
        if (distance(scene.movables[i].figure, placed.movables[i], x, y) <= radius) return false;
    for (const Obstacle& obstacle : scene.obstacles)
        if (distance(obstacle.figure, obstacle.pose, x, y) <= radius) return false;
    return scene.arena.distance(x, y) >= radius;
}

Pose draw_free_pose(const Scene& scene, const EpisodeKey& key, Purpose purpose, unsigned number, const Starts& placed,
                    const double* region, double radius, const char* what) {
    for (unsigned attempt = 0; attempt < kPlacementAttempts; ++attempt) {
        const auto words = draw(key, purpose, number, attempt);
        const double x = region[0] + uniform(words[0]) * (region[1] - region[0]);
        const double y = region[2] + uniform(words[1]) * (region[3] - region[2]);
        if (is_free(scene, placed, x, y, radius)) return {x, y, kPi * symmetric(words[2])};
    }
    throw Error(SWE_INVALID_ARGUMENT, std::string(what) + ".start_region: no free place for " + what + " " +
                                          std::to_string(number) + " in " + std::to_string(kPlacementAttempts) +
                                          " attempts: enlarge it");
}

// Those with a given pose stand there already when the others are drawn.
void place_movables(const Scene& scene, const EpisodeKey& key, Starts& starts) {
    for (const auto& [config, figure] : scene.movables)
        starts.movables.push_back(
            config.start == SWE_START_RANDOM ? kNowhere : Pose{config.pose[0], config.pose[1], config.pose[2]});
    for (unsigned i = 0; i < scene.movables.size(); ++i) {
        const auto& [config, figure] = scene.movables[i];
        if (config.start == SWE_START_RANDOM)
            starts.movables[i] = draw_free_pose(scene, key, Purpose::movable_start, i, starts, config.start_region,
                                                figure.reach, "movable");
    }
}

}  // namespace

Starts draw_starts(const Scene& scene, const EpisodeKey& key) {
    Starts starts;
    place_movables(scene, key, starts);
    for (unsigned robot = 0; robot < scene.robots; ++robot) {
        if (scene.team.start == SWE_START_RANDOM) {
            starts.robots.push_back(draw_free_pose(scene, key, Purpose::start, robot, starts, scene.team.start_region,
                                                   scene.robot.radius, "robot"));
            continue;
        }
        const auto words = draw(key, Purpose::start, robot, 0);
        const Pose& pose = scene.start_poses[robot];
        const double* jitter = scene.team.start_jitter;
        starts.robots.push_back({pose.x + jitter[0] * symmetric(words[0]), pose.y + jitter[0] * symmetric(words[1]),
                                 pose.heading + jitter[1] * symmetric(words[2])});
    }
    return starts;
}

bool is_at_goal(const Scene& scene, const swe_goal_config& goal, const Figure& figure, const Pose& at) {
    if (goal.kind == SWE_GOAL_REGION)
        return at.x >= goal.region[0] && at.x <= goal.region[1] && at.y >= goal.region[2] && at.y <= goal.region[3];
    // Distance from its centre to its farthest point towards the wall.
    const double cosine = std::abs(std::cos(at.heading)), sine = std::abs(std::sin(at.heading));
    const double along_x = figure.is_round ? figure.half_x : cosine * figure.half_x + sine * figure.half_y;
    const double along_y = figure.is_round ? figure.half_x : sine * figure.half_x + cosine * figure.half_y;
    const double* bounds = scene.arena.bounds();
    switch (goal.kind) {
        case SWE_GOAL_NORTH: return at.y + along_y > bounds[3] - kTouchDistance;
        case SWE_GOAL_SOUTH: return along_y - at.y > -bounds[2] - kTouchDistance;
        case SWE_GOAL_EAST: return at.x + along_x > bounds[1] - kTouchDistance;
        default: return along_x - at.x > -bounds[0] - kTouchDistance;
    }
}

bool is_at_any_goal(const Scene& scene, unsigned movable, const Pose& at) {
    return std::any_of(scene.goals.begin(), scene.goals.end(), [&](const swe_goal_config& goal) {
        return is_at_goal(scene, goal, scene.movables[movable].figure, at);
    });
}

Episode::Episode(const Scene& scene, const EpisodeKey& key, Recorder recorder)
    : scene_(scene),
      key_(key),
      recorder_(std::move(recorder)),
      world_(scene, draw_starts(scene, key)),
      observations_(scene.robots * scene.suite.size()),
      clipped_(scene.robots * scene.commands, kNotYet),
      homing_times_(scene.robots, kNotYet),
      goal_times_(scene.movables.size(), kNotYet),
      push_time_(kNotYet),
      hash_(world_.fold_state(kHashStart)) {
    now_.robots.resize(scene.robots);
    now_.movables.resize(scene.movables.size());
    at_goal_.resize(scene.movables.size());
    if (scene.sensors.touch_mode == SWE_TOUCH_MODE_FORCE) now_.push_forces.resize(scene.robots * scene.movables.size());
    if (scene.suite.place_of(SWE_SENSOR_MOVABLE_MOTION) >= 0) now_.motions.resize(scene.movables.size());
    if (scene.suite.place_of(SWE_SENSOR_ODOMETRY) >= 0) now_.wheel_speeds.resize(2 * scene.robots);
    now_.messages.resize(scene.robots * scene.message_bits);
    look_around();
}

// Takes the moment's poses and notes who has reached what.
void Episode::look_around() {
    const double time = step_ * scene_.episode.control_period;
    for (unsigned i = 0; i < now_.robots.size(); ++i) now_.robots[i] = world_.robot_pose(i);
    for (unsigned i = 0; i < now_.movables.size(); ++i) {
        now_.movables[i] = world_.movable_pose(i);
        at_goal_[i] = is_at_any_goal(scene_, i, now_.movables[i]);
        if (std::isnan(goal_times_[i]) && at_goal_[i]) goal_times_[i] = time;
    }
    for (unsigned i = 0; i < now_.robots.size(); ++i)
        if (std::isnan(homing_times_[i]) && in_emitter_range(scene_, now_, i)) homing_times_[i] = time;
    const auto is_pending = [](double goal_time) { return std::isnan(goal_time); };
    if (!goal_times_.empty() && std::isnan(push_time_) &&
        std::none_of(goal_times_.begin(), goal_times_.end(), is_pending))
        push_time_ = time;
    feel();
}

// Takes what sensors read beside poses.
void Episode::feel() {
    for (std::size_t i = 0; i < now_.push_forces.size(); ++i)
        now_.push_forces[i] = world_.push_force(i / now_.movables.size(), i % now_.movables.size());
    for (unsigned i = 0; i < now_.motions.size(); ++i) now_.motions[i] = world_.movable_motion(i);
    for (unsigned i = 0; i < now_.wheel_speeds.size(); ++i)
        now_.wheel_speeds[i] = world_.wheel_speed(i / 2, static_cast<Side>(i % 2));
    for (unsigned i = 0; i < now_.messages.size(); ++i) now_.messages[i] = message_bit(scene_, clipped_.data(), i) > 0;
}

const double* Episode::observe() {
    if (is_observed_) return observations_.data();
    for (unsigned robot = 0; robot < scene_.robots; ++robot)
        scene_.suite.sense({scene_, now_, key_, step_, robot}, observations_.data() + robot * scene_.suite.size());
    is_observed_ = true;
    return observations_.data();
}

void Episode::advance(const double* commands) {
    const unsigned each = scene_.commands;
    for (std::size_t i = 0; i < clipped_.size(); ++i) {
        if (!std::isfinite(commands[i]))
            throw Error(SWE_POLICY_ERROR, "the controller of robot " + std::to_string(i / each) +
                                              " gave a command that is not finite at control step " +
                                              std::to_string(step_));
        clipped_[i] = std::clamp(commands[i], -1.0, 1.0);
    }
    record();

    for (unsigned robot = 0; robot < scene_.robots; ++robot) {
        const auto words = draw(key_, Purpose::wheels, robot, step_);
        const double* command = &clipped_[robot * each];
        world_.set_rim_speeds(robot, rim_speed(scene_.robot, command[0], scene_.noise.wheels * symmetric(words[0])),
                              rim_speed(scene_.robot, command[1], scene_.noise.wheels * symmetric(words[1])));
    }
    for (unsigned i = 0; i < scene_.substeps; ++i) world_.step();
    ++step_;
    hash_ = world_.fold_state(hash_);
    is_observed_ = false;
    look_around();
    is_done_ = step_ == scene_.control_steps || (scene_.episode.until == SWE_UNTIL_PUSH && !std::isnan(push_time_));
    if (is_done_) leave_empty();
}

Moment Episode::moment() {
    observe();
    return {scene_, now_, key_, step_, at_goal_.data(), observations_.data(), clipped_.data()};
}

void Episode::record() {
    if (recorder_.empty()) return;
    const Moment now = moment();
    for (const Track& track : recorder_) track.channel->write(track.values + step_ * track.channel->size(scene_), now);
}

// Records nothing of the steps that will not be.
void Episode::leave_empty() {
    for (const Track& track : recorder_) {
        const std::size_t size = track.channel->size(scene_);
        std::fill(track.values + step_ * size, track.values + scene_.control_steps * size, kNotYet);
    }
}

swe_outcome Episode::outcome(double* homing_times) const {
    std::copy(homing_times_.begin(), homing_times_.end(), homing_times);
    swe_outcome outcome{};
    outcome.status = SWE_OK;
    outcome.ode_messages = world_.ode_messages();
    outcome.unsolved_steps = world_.unsolved_steps();
    outcome.control_steps = step_;
    outcome.hash = hash_;
    outcome.push_time = push_time_;
    std::fill_n(outcome.box_pose, 3, kNotYet);
    if (!now_.movables.empty()) std::copy_n(&now_.movables[0].x, 3, outcome.box_pose);
    outcome.max_penetration = world_.extremes().penetration;
    outcome.max_lift = world_.extremes().lift;
    outcome.min_upright = world_.extremes().upright;
    return outcome;
}

}  // namespace swarmevo

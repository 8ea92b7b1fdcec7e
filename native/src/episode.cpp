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
constexpr double kTouchDistance = 0.002;        // between box and wall [m]
constexpr unsigned kPlacementAttempts = 10000;  // for each robot
constexpr std::uint64_t kHashStart = 0xCBF29CE484222325u;

bool is_free(const Scene& scene, const std::vector<Pose>& placed, double x, double y) {
    for (const Pose& other : placed)
        if (std::hypot(x - other.x, y - other.y) < 2 * scene.robot.radius) return false;
    const double cosine = std::cos(scene.box.pose[2]), sine = std::sin(scene.box.pose[2]);
    const double dx = x - scene.box.pose[0], dy = y - scene.box.pose[1];
    return separate_point_from_rectangle(cosine * dx + sine * dy, cosine * dy - sine * dx, scene.box.size[0] / 2,
                                         scene.box.size[1] / 2)
               .distance > scene.robot.radius;
}

Pose draw_free_pose(const Scene& scene, const EpisodeKey& key, const std::vector<Pose>& placed) {
    const double* region = scene.team.start_region;
    const auto robot = static_cast<unsigned>(placed.size());
    for (unsigned attempt = 0; attempt < kPlacementAttempts; ++attempt) {
        const auto words = draw(key, Purpose::start, robot, attempt);
        const double x = region[0] + uniform(words[0]) * (region[1] - region[0]);
        const double y = region[2] + uniform(words[1]) * (region[3] - region[2]);
        if (is_free(scene, placed, x, y)) return {x, y, kPi * symmetric(words[2])};
    }
    throw Error(SWE_INVALID_ARGUMENT, "team.start_region: no free place for robot " + std::to_string(robot) + " in " +
                                          std::to_string(kPlacementAttempts) + " attempts: enlarge it");
}

}  // namespace

std::vector<Pose> draw_starts(const Scene& scene, const EpisodeKey& key) {
    std::vector<Pose> starts;
    for (unsigned robot = 0; robot < scene.robots; ++robot) {
        if (scene.team.start == SWE_START_RANDOM) {
            starts.push_back(draw_free_pose(scene, key, starts));
            continue;
        }
        const auto words = draw(key, Purpose::start, robot, 0);
        const Pose& pose = scene.start_poses[robot];
        const double* jitter = scene.team.start_jitter;
        starts.push_back({pose.x + jitter[0] * symmetric(words[0]), pose.y + jitter[0] * symmetric(words[1]),
                          pose.heading + jitter[1] * symmetric(words[2])});
    }
    return starts;
}

bool box_touches_target(const Scene& scene, const Pose& box) {
    // Distance from the box's centre to its corner farthest towards the wall.
    const double along_x =
        (std::abs(std::cos(box.heading)) * scene.box.size[0] + std::abs(std::sin(box.heading)) * scene.box.size[1]) / 2;
    const double along_y =
        (std::abs(std::sin(box.heading)) * scene.box.size[0] + std::abs(std::cos(box.heading)) * scene.box.size[1]) / 2;
    const double wall = scene.arena.size / 2 - kTouchDistance;
    switch (scene.arena.target_wall) {
        case SWE_TARGET_WALL_NORTH: return box.y + along_y > wall;
        case SWE_TARGET_WALL_SOUTH: return along_y - box.y > wall;
        case SWE_TARGET_WALL_EAST: return box.x + along_x > wall;
        default: return along_x - box.x > wall;
    }
}

Episode::Episode(const Scene& scene, const EpisodeKey& key, Recorder recorder)
    : scene_(scene),
      key_(key),
      recorder_(std::move(recorder)),
      world_(scene, draw_starts(scene, key)),
      observations_(scene.robots * scene.suite.size()),
      clipped_(scene.robots * scene.commands, kNotYet),
      homing_times_(scene.robots, kNotYet),
      push_time_(kNotYet),
      hash_(world_.fold_state(kHashStart)) {
    now_.robots.resize(scene.robots);
    if (scene.sensors.touch_mode == SWE_TOUCH_MODE_FORCE) now_.push_forces.resize(scene.robots);
    look_around();
}

// Takes the moment's poses and notes who has reached what.
void Episode::look_around() {
    const double time = step_ * scene_.episode.control_period;
    for (unsigned robot = 0; robot < scene_.robots; ++robot) {
        now_.robots[robot] = world_.robot_pose(robot);
        if (std::isnan(homing_times_[robot]) && in_emitter_range(scene_, now_.robots[robot]))
            homing_times_[robot] = time;
    }
    for (unsigned robot = 0; robot < now_.push_forces.size(); ++robot)
        now_.push_forces[robot] = world_.push_force(robot);
    now_.box = world_.box_pose();
    box_touches_target_ = box_touches_target(scene_, now_.box);
    if (std::isnan(push_time_) && box_touches_target_) push_time_ = time;
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
    return {scene_, now_, key_, step_, box_touches_target_, observations_.data(), clipped_.data()};
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
    std::copy_n(&now_.box.x, 3, outcome.box_pose);
    outcome.max_penetration = world_.extremes().penetration;
    outcome.max_lift = world_.extremes().lift;
    outcome.min_upright = world_.extremes().upright;
    return outcome;
}

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
// One episode: sense -> act -> step, to the horizon.
#pragma once

#include <vector>

#include "channels.hpp"
#include "rng.hpp"
#include "scene/scene.hpp"
#include "sensors/snapshot.hpp"
#include "world/world.hpp"

namespace swarmevo {

class Episode {
  public:
    // Throws Error if the robots cannot be placed.
    Episode(const Scene& scene, const EpisodeKey& key, Recorder recorder);

    bool done() const { return is_done_; }

    // (robots, observations) of this moment, sensed once.
    const double* observe();

    // Lets commands (robots, commands) act for one control period. Not when done.
    // Throws Error: a command is not finite, or the physics failed.
    void advance(const double* commands);

    // This moment, sensed; its commands are those of the last step, NaN before the first. Valid until the next step.
    Moment moment();

    // Outcome so far; homing_times (robots).
    swe_outcome outcome(double* homing_times) const;

  private:
    void look_around();
    void feel();
    void record();
    void leave_empty();

    const Scene& scene_;
    const EpisodeKey key_;
    const Recorder recorder_;
    World world_;
    unsigned step_ = 0;

    Snapshot now_;
    bool is_done_ = false;
    std::vector<char> at_goal_;  // for each movable
    bool is_observed_ = false;
    std::vector<double> observations_, clipped_, homing_times_, goal_times_;
    double push_time_;
    std::uint64_t hash_;
};

// Start poses of an episode: given ones with jitter, or random ones. Throws Error if no free place is found.
Starts draw_starts(const Scene& scene, const EpisodeKey& key);

// Is a movable, by its place in the scene's list, where it is to be brought?
bool is_at_any_goal(const Scene& scene, unsigned movable, const Pose& at);

}  // namespace swarmevo

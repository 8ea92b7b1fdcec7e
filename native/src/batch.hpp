// SPDX-License-Identifier: BSD-3-Clause
// Many episodes over worker threads: run natively to their end, or stepped together for controllers elsewhere.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "episode.hpp"
#include "pool.hpp"
#include "scene/scene.hpp"

namespace swarmevo {

class Batch {
  public:
    Batch(std::shared_ptr<const Scene> scene, unsigned threads);

    const Scene& scene() const { return *scene_; }
    bool is_here() const { return pool_.is_here(); }  // as Pool::is_here

    // The arguments of swe_batch_run, checked. `records` holds one recorder for each episode.
    void run(swe_outcome* outcomes, double* homing_times, const std::vector<Recorder>& records,
             const swe_episode* episodes, std::size_t n, const swe_policy* policies,
             const std::uint32_t* robot_policies);

    // Lockstep: begin, then observe, advance, reset and state in any order, end. What a world does never depends on the
    // others; one that has failed or is at its horizon stands still until it is reset.
    void begin(std::vector<Recorder> records, const swe_episode* episodes, std::size_t n);
    bool running() const { return running_; }
    std::size_t worlds() const { return lockstep_.size(); }
    std::size_t movable() const;  // worlds that can go on
    std::size_t failed() const;   // worlds
    void observe(double* observations);
    void advance(const double* commands);
    void reset(const std::uint32_t* worlds, const swe_episode* episodes, std::size_t n);  // worlds: each once
    // Outcomes and homing times so far, null if not wanted, and this moment's channels, to one recorder for each world.
    void state(swe_outcome* outcomes, double* homing_times, const std::vector<Recorder>& channels);
    void end(swe_outcome* outcomes, double* homing_times);

    // "" where episode i went well.
    const std::string& message(std::size_t i) const;

  private:
    template <typename Body>
    void attempt(std::size_t i, Body body);
    void start(std::size_t i, const swe_episode& episode);
    bool can_go_on(std::size_t i) const { return statuses_[i] == SWE_OK && !lockstep_[i]->done(); }
    swe_outcome finish(std::size_t i, const Episode* episode, double* homing_times) const;

    const std::shared_ptr<const Scene> scene_;
    Pool pool_;
    std::vector<std::string> messages_;
    std::vector<swe_status> statuses_;

    bool running_ = false;
    std::vector<Recorder> records_;                   // of the worlds in lockstep
    std::vector<std::unique_ptr<Episode>> lockstep_;  // null where the episode could not begin
};

}  // namespace swarmevo

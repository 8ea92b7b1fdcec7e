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

    // The arguments of swe_batch_run, checked. `records` holds one recorder for each episode.
    void run(swe_outcome* outcomes, double* homing_times, const std::vector<Recorder>& records,
             const swe_episode* episodes, std::size_t n, const swe_policy* policies,
             const std::uint32_t* robot_policies);

    // Lockstep: begin, (observe, advance) for every control step, end.
    void begin(const std::vector<Recorder>& records, const swe_episode* episodes, std::size_t n);
    bool running() const { return running_; }
    std::size_t worlds() const { return lockstep_.size(); }
    unsigned steps_left() const { return steps_left_; }
    void observe(double* observations);
    void advance(const double* commands);
    void end(swe_outcome* outcomes, double* homing_times);

    // "" where episode i went well.
    const std::string& message(std::size_t i) const;

  private:
    template <typename Body>
    void attempt(std::size_t i, Body body);
    swe_outcome finish(std::size_t i, const Episode* episode, double* homing_times) const;

    const std::shared_ptr<const Scene> scene_;
    Pool pool_;
    std::vector<std::string> messages_;
    std::vector<swe_status> statuses_;

    bool running_ = false;
    unsigned steps_left_ = 0;
    std::vector<std::unique_ptr<Episode>> lockstep_;
};

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
// No bumpers meet within the step and are pressed in by more than a little in the end: forces of a contact that begins
// apart are too weak. Else the step ends where the first of them meet, whatever else is wrong with it; once in a step.
#include "world/assume/list.hpp"
#include "world/constants.hpp"

namespace swarmevo {
namespace {

class NoImpacts : public Assumption {
  public:
    explicit NoImpacts(State& state) : state_(state) {}

    Finding check(Attempt& attempt) override {
        if (attempt.uncut_length > 0) return {};
        const double share = state_.average.until_impact();
        if (share == 1 || share * attempt.time_step < kShortestStep) return {};
        attempt.uncut_length = attempt.time_step;
        return {false, true, share};
    }

  private:
    State& state_;
};

}  // namespace

std::unique_ptr<Assumption> assume_no_impacts(State& state) {
    return std::make_unique<NoImpacts>(state);
}

}  // namespace swarmevo

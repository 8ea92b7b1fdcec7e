// SPDX-License-Identifier: BSD-3-Clause
// Bodies in touch change their speed so little in the step that they end where they should (average.hpp). Else it is
// cut; and the next steps are as long as this one's error allows.
#include <algorithm>
#include <cmath>

#include "world/assume/list.hpp"
#include "world/constants.hpp"

namespace swarmevo {
namespace {

class SteadySpeeds : public Assumption {
  public:
    explicit SteadySpeeds(State& state)
        : state_(state),
          largest_error_(state.scene.robot.bumper == SWE_BUMPER_RIGID ? kRigidPositionError : kPositionError),
          length_(state.scene.physics.time_step) {}

    double longest_step() const override { return length_; }

    // In powers of two.
    Finding check(Attempt& attempt) override {
        double share = 1;
        for (double left = error(); left > largest_error_ && share * attempt.time_step > kShortestStep; left /= 4)
            share /= 2;
        return {true, false, share};
    }

    void accept(const Attempt& attempt) override {
        const double found = error();
        const double growth = found > 0 ? std::clamp(std::sqrt(largest_error_ / found), 0.5, 2.0) : 2;
        length_ = std::clamp(std::fmax(attempt.time_step * growth, attempt.uncut_length), kShortestStep,
                             state_.scene.physics.time_step);
    }

  private:
    double error() const { return state_.is_level ? state_.average.error() : 0; }

    State& state_;
    const double largest_error_;  // [m]
    double length_;               // of the next step [s]
};

}  // namespace

std::unique_ptr<Assumption> assume_steady_speeds(State& state) {
    return std::make_unique<SteadySpeeds>(state);
}

}  // namespace swarmevo

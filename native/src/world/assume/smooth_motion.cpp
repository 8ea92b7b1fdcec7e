// SPDX-License-Identifier: BSD-3-Clause
// A body that moved smoothly in the last step goes on so: Newton's method takes a step of second order then
// (compliant.hpp). It finds out itself where an impact or a new command ends that; a step that was not its own does
// too.
#include "world/assume/list.hpp"

namespace swarmevo {
namespace {

class SmoothMotion : public Assumption {
  public:
    explicit SmoothMotion(State& state) : state_(state) {}

    void accept(const Attempt& attempt) override {
        if (attempt.solver == Solver::newton)
            state_.compliant.remember();
        else
            state_.compliant.forget();
    }

  private:
    State& state_;
};

}  // namespace

std::unique_ptr<Assumption> assume_smooth_motion(State& state) {
    return std::make_unique<SmoothMotion>(state);
}

}  // namespace swarmevo

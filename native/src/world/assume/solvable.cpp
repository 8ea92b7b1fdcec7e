// SPDX-License-Identifier: BSD-3-Clause
// ODE's solver does not stall. Where rows of its contact problem tie, it may drop the rest of them ("LCP internal
// error"), and robots would sink into the floor. Then contacts are softer, no two alike; then the step is halved, and
// so on in turn, until it is accepted as it is.
#include "world/assume/list.hpp"
#include "world/constants.hpp"

namespace swarmevo {
namespace {

class Solvable : public Assumption {
  public:
    void before_contacts(Attempt& attempt) override { attempt.is_soft = is_soft_; }

    Finding check(Attempt& attempt) override {
        if (attempt.warnings == 0) return {};
        is_soft_ = !attempt.is_soft;
        if (is_soft_) return {false, true};
        if (halvings_++ == kMostHalvings) return {true, true};
        return {false, true, 0.5};
    }

    void accept(const Attempt&) override {
        is_soft_ = false;
        halvings_ = 0;
    }

  private:
    bool is_soft_ = false;
    int halvings_ = 0;  // of this step
};

}  // namespace

std::unique_ptr<Assumption> assume_solvable(State&) {
    return std::make_unique<Solvable>();
}

}  // namespace swarmevo

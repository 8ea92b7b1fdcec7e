// SPDX-License-Identifier: BSD-3-Clause
// A movable that stood goes on standing: to all that touch it, it is a wall. Checked against the limit curve of its
// feet (movable.hpp); where they give way, it is solved for, beginning with the motion in which they do.
#include "world/assume/list.hpp"

namespace swarmevo {
namespace {

class StandingMovables : public Assumption {
  public:
    explicit StandingMovables(State& state) : state_(state) {}

    void before_contacts(Attempt& attempt) override {
        if (!attempt.is_new) return;
        for (Movable& movable : state_.movables)
            movable.assume_standing(movable.stands() || state_.average.has_settled(movable.number()));
    }

    Finding check(Attempt&) override {
        bool all = true;
        for (Movable& movable : state_.movables)
            if (movable.stands()) all &= movable.withstands(state_.sides.load_on(movable.number()));
        return {all};
    }

  private:
    State& state_;
};

}  // namespace

std::unique_ptr<Assumption> assume_standing_movables(State& state) {
    return std::make_unique<StandingMovables>(state);
}

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
// A robot that nothing but the floor is near and whose wheels hold coasts: it goes where its wheels take it, in closed
// form. Whether they hold follows from how it moves and is told to move, so there is nothing to check afterwards; that
// nothing meets it is what clearance.cpp checks.
#include "world/assume/list.hpp"

namespace swarmevo {
namespace {

class Coasting : public Assumption {
  public:
    explicit Coasting(State& state) : state_(state) {}

    void before_solving(Attempt& attempt) override {
        for (Robot& robot : state_.robots)
            if (robot.is_free && robot.drive->can_coast(attempt.time_step)) robot.role = Role::coasts;
    }

    void accept(const Attempt& attempt) override {
        for (Robot& robot : state_.robots)
            if (robot.role == Role::coasts) robot.drive->coast(attempt.time_step);
    }

  private:
    State& state_;
};

}  // namespace

std::unique_ptr<Assumption> assume_coasting(State& state) {
    return std::make_unique<Coasting>(state);
}

}  // namespace swarmevo

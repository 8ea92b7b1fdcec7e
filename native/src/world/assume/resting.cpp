// SPDX-License-Identifier: BSD-3-Clause
// Robots at rest after the last step, whose wheels turn as they did, stay at rest, if all that touch them do; a
// movable that stands is like a wall. Among them are robots that push in vain. The same forces give the same rest:
// there is nothing to check afterwards.
//
// Not where sensors feel forces, which settle a little later than motions.
#include <algorithm>
#include <vector>

#include "world/assume/list.hpp"

namespace swarmevo {
namespace {

class Resting : public Assumption {
  public:
    explicit Resting(State& state)
        : state_(state),
          feels_forces_(state.scene.sensors.touch_mode == SWE_TOUCH_MODE_FORCE),
          rests_(state.scene.robots + state.scene.movables.size()) {}

    void before_solving(Attempt&) override {
        if (feels_forces_ || !find_resting_robots()) return;
        for (Robot& robot : state_.robots) {
            if (!rests_[robot.number]) continue;
            robot.role = Role::rests;
            state_.average.hold(robot.number);
        }
    }

  private:
    // Returns whether there may be any.
    bool find_resting_robots() {
        bool any = false;
        for (const Robot& robot : state_.robots) {
            const bool rests = !robot.is_free && robot.is_steady && state_.average.has_settled(robot.number);
            rests_[robot.number] = rests;
            any |= rests;
        }
        if (!any) return false;
        const auto& touches = state_.average.touches();
        while (std::any_of(touches.begin(), touches.end(), [&](const auto& touch) { return wakes_up(touch); }))
            continue;
        return true;
    }

    // Does one of two that touch not rest? Then neither does the other.
    bool wakes_up(const AverageVelocity::Touch& touch) {
        const int movable = touch.second - static_cast<int>(state_.robots.size());
        const bool is_fixed =
            touch.second == AverageVelocity::kWall || (movable >= 0 && state_.movables[movable].stands());
        if (is_fixed || rests_[touch.first] == rests_[touch.second]) return false;
        rests_[touch.first] = rests_[touch.second] = false;
        return true;
    }

    State& state_;
    const bool feels_forces_;
    std::vector<char> rests_;  // by the body's number; never a movable, which moves if it does not stand
};

}  // namespace

std::unique_ptr<Assumption> assume_resting(State& state) {
    return std::make_unique<Resting>(state);
}

}  // namespace swarmevo

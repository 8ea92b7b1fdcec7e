// SPDX-License-Identifier: BSD-3-Clause
// A box that stood goes on standing: to all that touch it, it is a wall. Checked against the limit curve of its feet
// (box.hpp); where they give way, it is solved for, beginning with the motion in which they do.
#include "world/assume/list.hpp"

namespace swarmevo {
namespace {

class StandingBox : public Assumption {
  public:
    explicit StandingBox(State& state) : state_(state) {}

    void before_contacts(Attempt& attempt) override {
        Box& box = state_.box;
        if (attempt.is_new) box.assume_standing(box.stands() || state_.average.has_settled(state_.box_number));
    }

    Finding check(Attempt&) override { return {!state_.box.stands() || state_.box.withstands(push_on_box())}; }

  private:
    // What robots do to the box.
    Load push_on_box() const {
        const Place& middle = state_.average.place(state_.box_number);
        Load load{};
        for (const Robot& robot : state_.robots) {
            const Sides::Pair& push = state_.sides.push(robot.number);
            if (!push.may_meet) continue;
            const double x = -push.force[0], y = -push.force[1];
            load.x += x;
            load.y += y;
            load.torque += (push.point[0] - middle.x) * y - (push.point[1] - middle.y) * x;
        }
        return load;
    }

    State& state_;
};

}  // namespace

std::unique_ptr<Assumption> assume_standing_box(State& state) {
    return std::make_unique<StandingBox>(state);
}

}  // namespace swarmevo

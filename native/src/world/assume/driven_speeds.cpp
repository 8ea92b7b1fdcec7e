// SPDX-License-Identifier: BSD-3-Clause
// No body is faster than wheels can make it, so that those that meet in a step are known at its start. One that is was
// thrown: what it hits is soon as fast, and may meet a third body before the step is over. Steps are short until it has
// slowed down.
#include <algorithm>
#include <cmath>

#include "error.hpp"
#include "world/assume/list.hpp"
#include "world/constants.hpp"

namespace swarmevo {
namespace {

double speed_of(dBodyID body) {
    const dReal* v = dBodyGetLinearVel(body);
    return norm(v[0], v[1]);
}

// NaN is larger than any number.
double larger(double a, double b) {
    return std::isnan(a) || a >= b ? a : b;
}

class DrivenSpeeds : public Assumption {
  public:
    explicit DrivenSpeeds(State& state)
        : state_(state), driven_(2 * rim_speed(state.scene.robot, 1, state.scene.noise.wheels)) {}

    double longest_step() const override {
        const double speed = fastest_motion();
        return speed > driven_ ? std::fmax(kThrownDistance / speed, kShortestStep) : Assumption::longest_step();
    }

  private:
    // Of any body's points [m/s].
    double fastest_motion() const {
        double fastest = 0;
        for (const Movable& movable : state_.movables) {
            const double rim = std::abs(dBodyGetAngularVel(movable.body())[2]) * movable.figure().reach;
            fastest = larger(fastest, speed_of(movable.body()) + rim);
        }
        for (const Robot& robot : state_.robots) fastest = larger(fastest, speed_of(robot.drive->body()));
        if (!std::isfinite(fastest)) throw Error(SWE_PHYSICS_ERROR, "a body's speed is no longer finite");
        return fastest;
    }

    State& state_;
    const double driven_;  // [m/s]
};

}  // namespace

std::unique_ptr<Assumption> assume_driven_speeds(State& state) {
    return std::make_unique<DrivenSpeeds>(state);
}

}  // namespace swarmevo

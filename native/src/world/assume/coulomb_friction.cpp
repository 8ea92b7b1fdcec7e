// SPDX-License-Identifier: BSD-3-Clause
// Friction that ODE solved for is Coulomb's: as large as the normal forces allow that the step came out with, and
// against the slip. ODE's rows are laid out for guesses of both; where they were wrong, the next try has better ones.
// Newton's method needs no guess (compliant.hpp).
#include "world/assume/list.hpp"

namespace swarmevo {
namespace {

class CoulombFriction : public Assumption {
  public:
    explicit CoulombFriction(State& state) : state_(state) {}

    Finding check(Attempt& attempt) override {
        if (attempt.solver != Solver::ode) return {};
        bool all = state_.sides.fits();
        for (Robot& robot : state_.robots)
            if (robot.role == Role::solved) all &= robot.drive->fits();
        for (Movable& movable : state_.movables)
            if (!movable.stands()) all &= movable.fits();
        return {all};
    }

  private:
    State& state_;
};

}  // namespace

std::unique_ptr<Assumption> assume_coulomb_friction(State& state) {
    return std::make_unique<CoulombFriction>(state);
}

}  // namespace swarmevo

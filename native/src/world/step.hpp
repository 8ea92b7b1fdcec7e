// SPDX-License-Identifier: BSD-3-Clause
// Takes a world through its time steps: contacts, a solver, and what is assumed (assumption.hpp).
#pragma once

#include <utility>
#include <vector>

#include "world/assumption.hpp"
#include "world/state.hpp"

namespace swarmevo {

class Stepper {
  public:
    // Works on the state, which must outlive it, as its assumptions do.
    Stepper(State& state, Assumptions assumptions) : state_(state), assumptions_(std::move(assumptions)) {}

    // One time step of the scene, in as many steps as it takes. Throws Error(SWE_PHYSICS_ERROR).
    void advance();

    unsigned ode_messages() const { return messages_; }
    unsigned unsolved_steps() const { return unsolved_; }

  private:
    double longest_step() const;
    double step(double time_step);
    void lay_out(Attempt& attempt);
    void expect_present_motion();
    void find_contacts(const Attempt& attempt);
    void find_contacts_of_movables();
    void solve(Attempt& attempt);
    bool solve_by_newton(double time_step);
    unsigned solve_by_ode(const Attempt& attempt);
    bool holds(Attempt& attempt);
    void accept(const Attempt& attempt);
    void save_bodies();
    void restore_bodies();

    State& state_;
    Assumptions assumptions_;
    std::vector<BodyState> before_;  // of state_.bodies, at the start of the step
    unsigned messages_ = 0, unsolved_ = 0;
};

}  // namespace swarmevo

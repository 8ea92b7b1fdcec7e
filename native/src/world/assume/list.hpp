// SPDX-License-Identifier: BSD-3-Clause
// All assumptions that a step rests on: each has a file of its name, which says what it is for.
#pragma once

#include <memory>

#include "world/assumption.hpp"
#include "world/state.hpp"

namespace swarmevo {

// Those of a world; they work on its state, which must outlive them.
Assumptions all_assumptions(State& state);

// What makes a step cheap: without one of these it is as true.
std::unique_ptr<Assumption> assume_clearance(State& state);
std::unique_ptr<Assumption> assume_coasting(State& state);
std::unique_ptr<Assumption> assume_resting(State& state);
std::unique_ptr<Assumption> assume_smooth_motion(State& state);
std::unique_ptr<Assumption> assume_standing_movables(State& state);

// What makes it true: without one of these it is cheaper, and may be wrong.
std::unique_ptr<Assumption> assume_coulomb_friction(State& state);
std::unique_ptr<Assumption> assume_driven_speeds(State& state);
std::unique_ptr<Assumption> assume_no_impacts(State& state);
std::unique_ptr<Assumption> assume_solvable(State& state);
std::unique_ptr<Assumption> assume_steady_speeds(State& state);

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
#include "world/assume/list.hpp"

namespace swarmevo {

Assumptions all_assumptions(State& state) {
    Assumptions all;
    all.push_back(assume_solvable(state));  // first: where the solver stalled there is nothing else to check
    all.push_back(assume_driven_speeds(state));
    all.push_back(assume_coulomb_friction(state));
    if (state.is_level) {  // the articulated reference runs at steps that need none of these
        all.push_back(assume_clearance(state));
        all.push_back(assume_coasting(state));
        all.push_back(assume_resting(state));
        all.push_back(assume_standing_movables(state));
        all.push_back(assume_smooth_motion(state));
        all.push_back(assume_no_impacts(state));  // behind what learns from its check: it may end the checks
    }
    all.push_back(assume_steady_speeds(state));
    return all;
}

}  // namespace swarmevo

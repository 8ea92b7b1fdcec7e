// SPDX-License-Identifier: BSD-3-Clause
// Whether a configuration describes a world that can be simulated.
#pragma once

#include "swarmevo.h"

namespace swarmevo {

// Returns it. Throws Error(SWE_INVALID_ARGUMENT) with all that is wrong, separated by "; ".
const swe_scene_config& checked(const swe_scene_config& config);

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
// Range and bearing of other robots, with a message: what the e-puck's board of Gutierrez et al. (ICRA 2009) measures,
// twelve infrared receivers round the body, cut into sectors as controllers of swarms take it.
//
// Simplification: nothing shades, neither robots nor walls, and a robot is heard in one sector alone, that of its
// centre.
#pragma once

#include "sensors/snapshot.hpp"
#include "sensors/suite.hpp"

namespace swarmevo {

extern const Device kRangeAndBearing;

}  // namespace swarmevo

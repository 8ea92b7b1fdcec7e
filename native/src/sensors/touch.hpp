// SPDX-License-Identifier: BSD-3-Clause
// Touch sensors: sectors of the body's rim, which answer to the nearest point of each movable.
#pragma once

#include "sensors/snapshot.hpp"
#include "sensors/suite.hpp"

namespace swarmevo {

extern const Device kTouch;

// Distance between a robot's rim and a movable [m]; negative where the bumper is pressed in, infinity where no
// touch sensor reaches so far.
double gap_to(const Glimpse& glimpse, unsigned movable);

// Touch readings in [0, 1], of the movable that answers most. SWE_TOUCH_MODE_FORCE alone reads the snapshot's
// push_forces.
void sense_touch(const Glimpse& glimpse, double* readings);

}  // namespace swarmevo

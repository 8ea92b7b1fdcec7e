// SPDX-License-Identifier: BSD-3-Clause
// How the movable moves that the robot touches, the nearest of several, in the robot's own directions: an ideal sensor,
// without noise.
#pragma once

#include "sensors/snapshot.hpp"
#include "sensors/suite.hpp"

namespace swarmevo {

extern const Device kMovableMotion;

}  // namespace swarmevo

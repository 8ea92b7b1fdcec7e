// SPDX-License-Identifier: BSD-3-Clause
// Ground sensors: the grey value of the floor below points of the robot.
#pragma once

#include "sensors/snapshot.hpp"
#include "sensors/suite.hpp"

namespace swarmevo {

extern const Device kGround;

// Of the floor at a point, 0 black to 1 white.
double ground_grey(const Scene& scene, double x, double y);

}  // namespace swarmevo

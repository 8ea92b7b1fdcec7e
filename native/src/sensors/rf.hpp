// SPDX-License-Identifier: BSD-3-Clause
// The RF receiver on top of the robot's centre: how strong the emitter's signal is.
#pragma once

#include "sensors/snapshot.hpp"
#include "sensors/suite.hpp"

namespace swarmevo {

extern const Device kRf;

// Is the emitter within its range of the robot's receiver?
bool in_emitter_range(const Scene& scene, const Pose& robot);

// Signal strength S = 1 / r^2 within its limits, with noise. Paper eq. 1: S = [1, 50].
double signal_strength(const Glimpse& glimpse);

}  // namespace swarmevo

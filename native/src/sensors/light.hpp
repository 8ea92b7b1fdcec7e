// SPDX-License-Identifier: BSD-3-Clause
// Light sensors: how bright the brightest light is in each sector round the robot. A light is an emitter of the channel
// SWE_CHANNEL_LIGHT; its brightness falls off as a signal's strength does.
//
// Simplification: nothing shades, neither robots nor obstacles.
#pragma once

#include "sensors/snapshot.hpp"
#include "sensors/suite.hpp"

namespace swarmevo {

extern const Device kLight;

}  // namespace swarmevo

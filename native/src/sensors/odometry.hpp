// SPDX-License-Identifier: BSD-3-Clause
// Wheel encoders: how fast each wheel turned in the last control step, slipping or not.
#pragma once

#include "sensors/snapshot.hpp"
#include "sensors/suite.hpp"

namespace swarmevo {

extern const Device kOdometry;

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
// The RF receiver on top of the robot's centre: how strong the signal of each channel is, and from where. One that
// hears nothing has readings as well, of the channel on which nobody sends.
#pragma once

#include "sensors/snapshot.hpp"
#include "sensors/suite.hpp"

namespace swarmevo {

extern const Device kRf, kRfBearing;

// Where an emitter is now [m].
std::array<double, 3> place_of(const swe_emitter_config& emitter, const Snapshot& now);

// Is an emitter of the first channel within its range of the robot's receiver?
bool in_emitter_range(const Scene& scene, const Snapshot& now, unsigned robot);

// Is an emitter heard, or a light seen, where the robot is?
bool is_heard(const Glimpse& glimpse, const swe_emitter_config& emitter);

// Strength 1 / r^2 of an emitter, by its place in the scene's list, within its limits and with noise; the smallest
// where it is not heard.
double strength_of(const Glimpse& glimpse, unsigned number, Purpose purpose, double deviation);

// Signal strength S = 1 / r^2 within its limits, with noise, of the strongest emitter of a channel; 0 where there is
// none. Paper eq. 1: S = [1, 50].
double signal_strength(const Glimpse& glimpse, unsigned channel = 0);

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
// Infrared proximity sensors: rays from the body's rim, answered by a curve of readings over distance.
#pragma once

#include "sensors/snapshot.hpp"
#include "sensors/suite.hpp"

namespace swarmevo {

extern const Device kInfrared;

// Distance that one infrared sensor of a robot measures, without noise [m]; infinity where nothing is in range.
double infrared_distance(const Scene& scene, const Snapshot& now, unsigned robot, unsigned sensor);

// Reading in [0, 1] for a distance: the curve, linear in between, over its first value; 0 beyond its end.
double infrared_response(const swe_sensors_config& sensors, double distance);

// All infrared readings of a robot, with noise, clipped to [0, 1].
void sense_infrared(const Glimpse& glimpse, double* readings);

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
// The sensor suite of a robot: the devices of its list side by side, which make up its observation.
#pragma once

#include <cstdint>
#include <vector>

#include "swarmevo.h"

namespace swarmevo {

struct Glimpse;

// A kind of sensor. Each has a file of its own in sensors/.
struct Device {
    std::int32_t kind;                                        // SWE_SENSOR_*
    unsigned (*width)(const swe_scene_config& checked);       // numbers in an observation
    void (*sense)(const Glimpse& glimpse, double* readings);  // all of them
};

// The device of a kind; null if there is none.
const Device* find_device(std::int32_t kind);

class SensorSuite {
  public:
    explicit SensorSuite(const swe_scene_config& checked);

    // Of an observation.
    unsigned size() const { return size_; }
    void sense(const Glimpse& glimpse, double* observation) const;

    // Where a device's readings begin in an observation; -1 if the robot has none of its kind.
    int place_of(std::int32_t kind) const;

  private:
    struct Part {
        const Device* device;
        unsigned first;  // of its numbers in an observation
    };
    std::vector<Part> parts_;
    unsigned size_ = 0;
};

}  // namespace swarmevo

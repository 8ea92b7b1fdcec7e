// SPDX-License-Identifier: BSD-3-Clause
#include "sensors/suite.hpp"

#include <algorithm>
#include <iterator>

#include "sensors/ground.hpp"
#include "sensors/infrared.hpp"
#include "sensors/light.hpp"
#include "sensors/movable_motion.hpp"
#include "sensors/odometry.hpp"
#include "sensors/range_and_bearing.hpp"
#include "sensors/rf.hpp"
#include "sensors/touch.hpp"

namespace swarmevo {
namespace {

constexpr const Device* kDevices[] = {&kInfrared, &kTouch,         &kRf,   &kRfBearing, &kRangeAndBearing, &kGround,
                                      &kOdometry, &kMovableMotion, &kLight};

}  // namespace

const Device* find_device(std::int32_t kind) {
    const auto* found =
        std::find_if(std::begin(kDevices), std::end(kDevices), [&](const Device* each) { return each->kind == kind; });
    return found == std::end(kDevices) ? nullptr : *found;
}

SensorSuite::SensorSuite(const swe_scene_config& checked) {
    for (unsigned i = 0; i < checked.robot.sensor_count; ++i) {
        const Device* device = find_device(checked.robot.sensors[i]);
        parts_.push_back({device, size_});
        size_ += device->width(checked);
    }
}

void SensorSuite::sense(const Glimpse& glimpse, double* observation) const {
    for (const Part& part : parts_) part.device->sense(glimpse, observation + part.first);
}

int SensorSuite::place_of(std::int32_t kind) const {
    for (const Part& part : parts_)
        if (part.device->kind == kind) return static_cast<int>(part.first);
    return -1;
}

}  // namespace swarmevo

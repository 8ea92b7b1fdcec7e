// SPDX-License-Identifier: BSD-3-Clause
// Sectors of equal width round a robot.
#pragma once

#include <algorithm>
#include <cmath>

#include "scene/scene.hpp"

namespace swarmevo {

// Sector of a bearing [rad], of n: the first is centred ahead, the others follow counter-clockwise.
inline unsigned sector_of(double bearing, unsigned n) {
    const double turns = bearing / (2 * kPi) + 0.5 / n;
    const double share = turns - std::floor(turns);
    return std::min(static_cast<unsigned>(share * n), n - 1);  // rounding may end at the whole turn
}

}  // namespace swarmevo

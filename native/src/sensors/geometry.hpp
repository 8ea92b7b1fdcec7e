// SPDX-License-Identifier: BSD-3-Clause
// What devices share: the geometry itself is that of scene/figure.hpp.
#pragma once

#include <limits>

#include "scene/scene.hpp"

namespace swarmevo {

constexpr double kNothing = std::numeric_limits<double>::infinity();

inline double square(double x) {
    return x * x;
}

}  // namespace swarmevo

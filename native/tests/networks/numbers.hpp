// SPDX-License-Identifier: BSD-3-Clause
// Weights and observations to try networks with.
#pragma once

#include <vector>

#include "rng.hpp"

// From N(0, 1), others for each stream.
inline std::vector<double> random_numbers(std::size_t n, unsigned stream) {
    std::vector<double> numbers;
    for (unsigned i = 0; i < n; ++i) {
        const auto words = swarmevo::draw({stream, 0, 0, 0}, swarmevo::Purpose::start, 0, i);
        numbers.push_back(swarmevo::normal(words[0], words[1]));
    }
    return numbers;
}

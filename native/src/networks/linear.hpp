// SPDX-License-Identifier: BSD-3-Clause
// Networks without hidden units: each command is a weighted sum of all that is observed.
#pragma once

#include <vector>

#include "networks/layer.hpp"

namespace swarmevo {

struct Linear {
    Layer output;
    int activation;  // SWE_ACTIVATION_*
};

class LinearNetworks {
  public:
    // Arrays as in swe_linear_create. Throws Error(SWE_INVALID_ARGUMENT) for a config out of range or a weight that is
    // not finite.
    LinearNetworks(const swe_linear_config& config, std::size_t n, const double* input_output);

    std::size_t size() const { return networks_.size(); }
    swe_policy policy(std::size_t i) const;

  private:
    std::vector<Linear> networks_;
};

}  // namespace swarmevo

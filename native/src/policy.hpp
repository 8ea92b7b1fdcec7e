// SPDX-License-Identifier: BSD-3-Clause
// Controllers that run natively: feed-forward networks with one hidden layer (paper II).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "swarmevo.h"

namespace swarmevo {

constexpr int kMaxHidden = 1024, kMaxObservations = 1024;

// One network. Hidden units that are switched off are not stored.
struct Network {
    Eigen::MatrixXd input_hidden;   // (active units, observations)
    Eigen::VectorXd hidden_bias;    // (active units)
    Eigen::MatrixXd hidden_output;  // (commands, active units)
    Eigen::VectorXd output_bias;    // (commands)
    int activation;                 // SWE_ACTIVATION_*
};

class Networks {
  public:
    // Arrays as in swe_networks_create. Throws Error(SWE_INVALID_ARGUMENT) for a config out of range or a weight that
    // is not finite.
    Networks(const swe_network_config& config, std::size_t n, const double* input_hidden, const double* hidden_output,
             const std::uint8_t* hidden_switch);

    std::size_t size() const { return networks_.size(); }
    swe_policy policy(std::size_t i) const;

  private:
    std::vector<Network> networks_;
};

}  // namespace swarmevo

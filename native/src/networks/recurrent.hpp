// SPDX-License-Identifier: BSD-3-Clause
// Networks with one hidden layer that hears, besides the observation, what the network did a control step ago: Elman's,
// Jordan's, and continuous-time ones, whose hidden units follow what drives them with time constants of their own.
#pragma once

#include <vector>

#include "networks/layer.hpp"

namespace swarmevo {

// One network. Hidden units that are switched off are not stored, nor what others would hear of them.
struct Recurrent {
    Layer hidden;
    Eigen::MatrixXd context_hidden;  // (units, context): the context is the hidden units, or the commands
    Eigen::VectorXd rates;           // (units): share of the way to what drives a unit that it goes in a control step
    Layer output;
    int activation;  // SWE_ACTIVATION_*
};

class RecurrentNetworks {
  public:
    // Arrays as in swe_recurrent_create. Throws Error(SWE_INVALID_ARGUMENT) for a config out of range, a weight that is
    // not finite, or a time constant that cannot be.
    RecurrentNetworks(const swe_recurrent_config& config, std::size_t n, const double* input_hidden,
                      const double* context_hidden, const double* hidden_output, const double* time_constants,
                      const std::uint8_t* hidden_switch);

    std::size_t size() const { return networks_.size(); }
    swe_policy policy(std::size_t i) const;

  private:
    std::vector<Recurrent> networks_;
    std::int32_t recurrence_;  // SWE_RECURRENCE_*
};

}  // namespace swarmevo

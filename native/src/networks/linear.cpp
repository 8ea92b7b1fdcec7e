// SPDX-License-Identifier: BSD-3-Clause
#include "networks/linear.hpp"

#include "policy.hpp"

namespace swarmevo {
namespace {

// swe_policy_function of a Linear.
void act(const void* parameters, const double* observation, double*, double* command) {
    const auto& network = *static_cast<const Linear*>(parameters);
    Eigen::Map<Eigen::VectorXd> output(command, network.output.bias.size());
    output = network.output.bias;
    add_weighted(output, network.output.weights, observation);
    for (double& o : output) o = activated_output(o, network.activation);
}

void check(const swe_linear_config& config) {
    if (config.struct_size != sizeof(swe_linear_config))
        throw Error(SWE_INVALID_ARGUMENT, "swe_linear_config.struct_size: library and caller differ in version");
    check_count("linear.observations", config.observations, 0, kMaxObservations);
    check_count("linear.commands", config.commands, 1, kMaxObservations);
    if (config.bias != 0 && config.bias != 1)
        throw Error(SWE_INVALID_ARGUMENT, "linear.bias: expected 0 or 1, got " + std::to_string(config.bias));
    if (config.activation < SWE_ACTIVATION_TANH || config.activation > SWE_ACTIVATION_IDENTITY)
        throw Error(SWE_INVALID_ARGUMENT, "linear.activation: not set, or not one of SWE_ACTIVATION_*");
}

}  // namespace

LinearNetworks::LinearNetworks(const swe_linear_config& config, std::size_t n, const double* input_output) {
    check(config);
    const Eigen::Index inputs = config.observations + static_cast<std::uint32_t>(config.bias),
                       commands = config.commands;
    const auto size = static_cast<std::size_t>(inputs * commands);
    check_finite(input_output, n, size, "input_output");

    networks_.reserve(n);
    for (std::size_t i = 0; i < n; ++i) {
        const Eigen::Map<const RowMajor> rows(input_output + i * size, commands, inputs);
        networks_.push_back({make_layer(rows, config.bias), config.activation});
    }
}

swe_policy LinearNetworks::policy(std::size_t i) const {
    const Linear& network = networks_[i];
    return {act, &network, 0, static_cast<std::uint32_t>(network.output.weights.cols()),
            static_cast<std::uint32_t>(network.output.bias.size())};
}

}  // namespace swarmevo

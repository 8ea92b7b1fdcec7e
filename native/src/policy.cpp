// SPDX-License-Identifier: BSD-3-Clause
#include "policy.hpp"

#include <cmath>
#include <string>

#include "error.hpp"
#include "networks/layer.hpp"

namespace swarmevo {
namespace {

using Hidden = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxHidden, 1>;  // on the stack

// swe_policy_function of a Network.
void act(const void* parameters, const double* observation, double*, double* command) {
    const auto& network = *static_cast<const Network*>(parameters);
    const Eigen::Map<const Eigen::VectorXd> input(observation, network.input_hidden.cols());
    Eigen::Map<Eigen::VectorXd> output(command, network.output_bias.size());
    const bool is_tanh = network.activation == SWE_ACTIVATION_TANH;

    Hidden hidden = network.hidden_bias;
    hidden.noalias() += network.input_hidden * input;
    for (double& h : hidden) h = is_tanh ? std::tanh(h) : logistic(h);

    output = network.output_bias;
    output.noalias() += network.hidden_output * hidden;
    for (double& o : output) o = is_tanh ? std::tanh(o) : 2 * logistic(o) - 1;
}

void check(const swe_network_config& config) {
    if (config.struct_size != sizeof(swe_network_config))
        throw Error(SWE_INVALID_ARGUMENT, "swe_network_config.struct_size: library and caller differ in version");
    if (config.hidden > kMaxHidden)
        throw Error(SWE_INVALID_ARGUMENT, "network.hidden: expected 0 to " + std::to_string(kMaxHidden) +
                                              " units, got " + std::to_string(config.hidden));
    if (config.observations > kMaxObservations)
        throw Error(SWE_INVALID_ARGUMENT, "network.observations: expected 0 to " + std::to_string(kMaxObservations) +
                                              ", got " + std::to_string(config.observations));
    if (config.commands < 1 || config.commands > kMaxObservations)
        throw Error(SWE_INVALID_ARGUMENT, "network.commands: expected 1 to " + std::to_string(kMaxObservations) +
                                              ", got " + std::to_string(config.commands));
    if (config.bias != 0 && config.bias != 1)
        throw Error(SWE_INVALID_ARGUMENT, "network.bias: expected 0 or 1, got " + std::to_string(config.bias));
    if (config.activation < SWE_ACTIVATION_TANH || config.activation > SWE_ACTIVATION_LOGISTIC)
        throw Error(SWE_INVALID_ARGUMENT, "network.activation: not set, or not one of SWE_ACTIVATION_*");
}

// Keeps the hidden units that are on. Weights of one network; the last column of each is the bias if there is one.
Network compact(const Eigen::Map<const RowMajor>& input_hidden, const Eigen::Map<const RowMajor>& hidden_output,
                const std::uint8_t* on, const swe_network_config& config) {
    std::vector<int> active;
    for (unsigned h = 0; h < config.hidden; ++h)
        if (on[h]) active.push_back(static_cast<int>(h));

    const auto units = static_cast<Eigen::Index>(active.size());
    const Eigen::Index observations = config.observations, commands = config.commands;
    Network network{Eigen::MatrixXd(units, observations), Eigen::VectorXd::Zero(units),
                    Eigen::MatrixXd(commands, units), Eigen::VectorXd::Zero(commands), config.activation};
    for (Eigen::Index i = 0; i < units; ++i) {
        if (observations > 0)  // else there is no data to point into
            network.input_hidden.row(i) = input_hidden.row(active[i]).head(observations);
        network.hidden_output.col(i) = hidden_output.col(active[i]);
        if (config.bias) network.hidden_bias[i] = input_hidden(active[i], observations);
    }
    if (config.bias) network.output_bias = hidden_output.col(config.hidden);
    return network;
}

}  // namespace

Networks::Networks(const swe_network_config& config, std::size_t n, const double* input_hidden,
                   const double* hidden_output, const std::uint8_t* hidden_switch) {
    check(config);
    const Eigen::Index hidden = config.hidden, inputs = config.observations + config.bias;
    const Eigen::Index commands = config.commands, fan_in = hidden + config.bias;
    const std::size_t size_ih = hidden * inputs, size_ho = commands * fan_in;
    check_finite(input_hidden, n, size_ih, "input_hidden");
    check_finite(hidden_output, n, size_ho, "hidden_output");

    networks_.reserve(n);
    for (std::size_t i = 0; i < n; ++i) {
        const Eigen::Map<const RowMajor> ih(input_hidden + i * size_ih, hidden, inputs);
        const Eigen::Map<const RowMajor> ho(hidden_output + i * size_ho, commands, fan_in);
        networks_.push_back(compact(ih, ho, hidden_switch + i * config.hidden, config));
    }
}

swe_policy Networks::policy(std::size_t i) const {
    const Network& network = networks_[i];
    return {act, &network, 0, static_cast<std::uint32_t>(network.input_hidden.cols()),
            static_cast<std::uint32_t>(network.output_bias.size())};
}

}  // namespace swarmevo

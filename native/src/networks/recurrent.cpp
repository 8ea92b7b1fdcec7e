// SPDX-License-Identifier: BSD-3-Clause
#include "networks/recurrent.hpp"

#include "policy.hpp"

namespace swarmevo {
namespace {

using Units = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxHidden, 1>;  // on the stack
using Memory = Eigen::Map<Eigen::VectorXd>;

// What the hidden units hear of the observation and the context.
template <typename Context>
void add_heard(Units& sums, const Recurrent& network, const double* observation, const Context& context) {
    add_weighted(sums, network.hidden.weights, observation);
    add_weighted(sums, network.context_hidden, context);
}

void activate(Units& units, const Recurrent& network) {
    for (double& unit : units) unit = activated_hidden(unit, network.activation);
}

void write_command(double* command, const Recurrent& network, const Units& hidden) {
    Eigen::Map<Eigen::VectorXd> output(command, network.output.bias.size());
    output = network.output.bias;
    add_weighted(output, network.output.weights, hidden);
    for (double& o : output) o = activated_output(o, network.activation);
}

// swe_policy_functions of a Recurrent.

void act_as_elman(const void* parameters, const double* observation, double* memory, double* command) {
    const auto& network = *static_cast<const Recurrent*>(parameters);
    Memory context(memory, network.hidden.bias.size());
    Units hidden = network.hidden.bias;
    add_heard(hidden, network, observation, context);
    activate(hidden, network);
    write_command(command, network, hidden);
    context = hidden;
}

void act_as_jordan(const void* parameters, const double* observation, double* memory, double* command) {
    const auto& network = *static_cast<const Recurrent*>(parameters);
    Memory context(memory, network.output.bias.size());
    Units hidden = network.hidden.bias;
    add_heard(hidden, network, observation, context);
    activate(hidden, network);
    write_command(command, network, hidden);
    context = Memory(command, context.size());
}

void act_as_ctrnn(const void* parameters, const double* observation, double* memory, double* command) {
    const auto& network = *static_cast<const Recurrent*>(parameters);
    Memory state(memory, network.hidden.bias.size());
    Units hidden = state + network.hidden.bias;
    activate(hidden, network);

    Units drive = Units::Zero(state.size());
    add_heard(drive, network, observation, hidden);
    state += network.rates.cwiseProduct(drive - state);

    hidden = state + network.hidden.bias;
    activate(hidden, network);
    write_command(command, network, hidden);
}

std::uint32_t context_size(const swe_recurrent_config& config) {
    return config.recurrence == SWE_RECURRENCE_JORDAN ? config.commands : config.hidden;
}

void check(const swe_recurrent_config& config) {
    const auto refuse = [](const std::string& message) { throw Error(SWE_INVALID_ARGUMENT, message); };
    if (config.struct_size != sizeof(swe_recurrent_config))
        refuse("swe_recurrent_config.struct_size: library and caller differ in version");
    check_count("recurrent.observations", config.observations, 0, kMaxObservations);
    check_count("recurrent.commands", config.commands, 1, kMaxObservations);
    check_count("recurrent.hidden", config.hidden, 0, kMaxHidden);
    if (config.bias != 0 && config.bias != 1)
        refuse("recurrent.bias: expected 0 or 1, got " + std::to_string(config.bias));
    if (config.activation < SWE_ACTIVATION_TANH || config.activation > SWE_ACTIVATION_LOGISTIC)
        refuse("recurrent.activation: not set, or not SWE_ACTIVATION_TANH or SWE_ACTIVATION_LOGISTIC");
    if (config.recurrence < SWE_RECURRENCE_ELMAN || config.recurrence > SWE_RECURRENCE_CTRNN)
        refuse("recurrent.recurrence: not set, or not one of SWE_RECURRENCE_*");
    if (config.recurrence != SWE_RECURRENCE_CTRNN) return;
    if (config.integration < SWE_INTEGRATION_EXPONENTIAL || config.integration > SWE_INTEGRATION_EULER)
        refuse("recurrent.integration: not set, or not one of SWE_INTEGRATION_*");
    if (!(config.control_period > 0) || !std::isfinite(config.control_period))
        refuse("recurrent.control_period: expected a number of seconds above 0, got " +
               std::to_string(config.control_period));
}

void check_time_constants(const double* time_constants, std::size_t count, const swe_recurrent_config& config) {
    const bool is_euler = config.integration == SWE_INTEGRATION_EULER;
    const double least = is_euler ? config.control_period : 0;  // a longer step of Euler's would overshoot
    for (std::size_t i = 0; i < count; ++i)
        if (!std::isfinite(time_constants[i]) || time_constants[i] < least || time_constants[i] <= 0)
            throw Error(SWE_INVALID_ARGUMENT,
                        std::string("time_constants: expected finite numbers of seconds, ") +
                            (is_euler ? "at least the control period of " + std::to_string(least) : "above 0") +
                            ", got " + std::to_string(time_constants[i]));
}

double rate(double time_constant, const swe_recurrent_config& config) {
    const double steps = config.control_period / time_constant;
    return config.integration == SWE_INTEGRATION_EULER ? steps : -std::expm1(-steps);
}

std::vector<int> switched_on(const std::uint8_t* on, std::uint32_t hidden) {
    std::vector<int> units;
    for (std::uint32_t h = 0; h < hidden; ++h)
        if (on[h]) units.push_back(static_cast<int>(h));
    return units;
}

}  // namespace

RecurrentNetworks::RecurrentNetworks(const swe_recurrent_config& config, std::size_t n, const double* input_hidden,
                                     const double* context_hidden, const double* hidden_output,
                                     const double* time_constants, const std::uint8_t* hidden_switch)
    : recurrence_(config.recurrence) {
    check(config);
    const auto bias = static_cast<std::uint32_t>(config.bias);
    const std::uint32_t hidden = config.hidden, context = context_size(config);
    const std::size_t size_ih = std::size_t{hidden} * (config.observations + bias),
                      size_ch = std::size_t{hidden} * context, size_ho = std::size_t{config.commands} * (hidden + bias);
    check_finite(input_hidden, n, size_ih, "input_hidden");
    check_finite(context_hidden, n, size_ch, "context_hidden");
    check_finite(hidden_output, n, size_ho, "hidden_output");
    const bool is_ctrnn = config.recurrence == SWE_RECURRENCE_CTRNN;
    if (is_ctrnn) check_time_constants(time_constants, n * hidden, config);

    networks_.reserve(n);
    for (std::size_t i = 0; i < n; ++i) {
        const Eigen::Map<const RowMajor> ih(input_hidden + i * size_ih, hidden, config.observations + bias);
        const Eigen::Map<const RowMajor> ch(context_hidden + i * size_ch, hidden, context);
        const Eigen::Map<const RowMajor> ho(hidden_output + i * size_ho, config.commands, hidden + bias);
        const std::vector<int> on = switched_on(hidden_switch + i * hidden, hidden);
        const bool hears_hidden = config.recurrence != SWE_RECURRENCE_JORDAN;

        Recurrent network{make_layer(RowMajor(ih(on, Eigen::all)), config.bias),
                          hears_hidden ? Eigen::MatrixXd(ch(on, on)) : Eigen::MatrixXd(ch(on, Eigen::all)),
                          Eigen::VectorXd::Ones(static_cast<Eigen::Index>(on.size())),
                          {ho(Eigen::all, on), Eigen::VectorXd::Zero(config.commands)},
                          config.activation};
        if (config.bias) network.output.bias = ho.col(hidden);
        for (std::size_t u = 0; is_ctrnn && u < on.size(); ++u)
            network.rates[static_cast<Eigen::Index>(u)] =
                rate(time_constants[i * hidden + static_cast<std::size_t>(on[u])], config);
        networks_.push_back(std::move(network));
    }
}

swe_policy RecurrentNetworks::policy(std::size_t i) const {
    const Recurrent& network = networks_[i];
    const auto units = static_cast<std::uint32_t>(network.hidden.bias.size());
    const auto observations = static_cast<std::uint32_t>(network.hidden.weights.cols());
    const auto commands = static_cast<std::uint32_t>(network.output.bias.size());
    switch (recurrence_) {
        case SWE_RECURRENCE_ELMAN: return {act_as_elman, &network, units, observations, commands};
        case SWE_RECURRENCE_JORDAN: return {act_as_jordan, &network, commands, observations, commands};
        default: return {act_as_ctrnn, &network, units, observations, commands};
    }
}

}  // namespace swarmevo

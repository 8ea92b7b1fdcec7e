// SPDX-License-Identifier: BSD-3-Clause
// Networks with a memory, or without hidden units: refused with a message, or their commands are computed from any
// observations, step after step. Every buffer is as long as it must be, so that a step beyond it is seen.
#include <cstdlib>

#include "bytes.hpp"
#include "swarmevo.h"

namespace {

// As a rule below `most`, now and then anything.
std::uint32_t count(Bytes& bytes, std::uint32_t most) {
    return bytes.below(64) ? static_cast<std::uint32_t>(bytes.below(most)) : bytes.take<std::uint32_t>();
}

// As a rule from 1 to `most`.
std::int32_t choice(Bytes& bytes, std::uint32_t most) {
    return bytes.below(16) ? 1 + static_cast<std::int32_t>(bytes.below(most)) : bytes.take<std::int32_t>();
}

std::int32_t flag(Bytes& bytes) {
    return bytes.below(16) ? static_cast<std::int32_t>(bytes.below(2)) : bytes.take<std::int32_t>();
}

// Acts with each network; what was not created must be told.
void try_out(Bytes& bytes, swe_status created, swe_networks* networks, std::size_t n, std::size_t inputs,
             std::size_t outputs) {
    if (created != SWE_OK) {
        if (networks || !*swe_error_message()) std::abort();
        return;
    }
    std::vector<swe_policy> policies(n);
    policies.reserve(1);  // never NULL, which is refused
    if (swe_networks_policies(policies.data(), n, networks) != SWE_OK) std::abort();
    for (const swe_policy& policy : policies) {
        std::vector<double> memory(policy.memory), command(outputs);
        for (int step = 0; step < 3; ++step) {
            const auto observation = bytes.numbers(inputs);
            policy.function(policy.parameters, observation.data(), memory.data(), command.data());
        }
    }
    swe_networks_destroy(networks);
}

void try_linear(Bytes& bytes) {
    constexpr std::uint32_t most_observations = 1024, most_commands = 8;  // that buffers are made for
    swe_linear_config config;
    swe_linear_config_init(&config);
    if (bytes.below(16) == 0) config.struct_size = bytes.take<std::uint32_t>();
    config.observations = count(bytes, 20);
    config.commands = count(bytes, 5);
    config.bias = flag(bytes);
    config.activation = choice(bytes, 3);
    const std::size_t n = bytes.below(4), inputs = std::min(config.observations, most_observations),
                      outputs = std::min(config.commands, most_commands);
    if (inputs < config.observations || outputs < config.commands) config.commands = 0;  // which is refused
    const auto weights = bytes.numbers(n * outputs * (inputs + (config.bias == 1)));
    swe_networks* networks = nullptr;
    const swe_status created = swe_linear_create(&networks, &config, n, weights.data());
    try_out(bytes, created, networks, n, inputs, outputs);
}

void try_recurrent(Bytes& bytes) {
    constexpr std::uint32_t most = 64;  // units of each kind that buffers are made for
    swe_recurrent_config config;
    swe_recurrent_config_init(&config);
    if (bytes.below(16) == 0) config.struct_size = bytes.take<std::uint32_t>();
    config.observations = count(bytes, 20);
    config.commands = count(bytes, 5);
    config.hidden = count(bytes, 20);
    config.bias = flag(bytes);
    config.activation = choice(bytes, 2);
    config.recurrence = choice(bytes, 3);
    config.integration = choice(bytes, 2);
    config.control_period = bytes.below(8) ? 0.1 : bytes.take<double>();
    const std::size_t n = bytes.below(4), inputs = std::min(config.observations, most),
                      hidden = std::min(config.hidden, most), outputs = std::min(config.commands, most);
    if (inputs < config.observations || hidden < config.hidden || outputs < config.commands) config.commands = 0;
    const std::size_t bias = config.bias == 1, context = config.recurrence == SWE_RECURRENCE_JORDAN ? outputs : hidden;
    const auto input_hidden = bytes.numbers(n * hidden * (inputs + bias));
    const auto context_hidden = bytes.numbers(n * hidden * context);
    const auto hidden_output = bytes.numbers(n * outputs * (hidden + bias));
    auto time_constants = bytes.numbers(n * hidden);
    if (bytes.below(8))
        for (double& constant : time_constants) constant = 0.1 + (constant < 10 ? std::abs(constant) : 10);
    std::vector<std::uint8_t> switches(n * hidden);
    for (auto& on : switches) on = static_cast<std::uint8_t>(bytes.below(3));
    switches.reserve(1);
    swe_networks* networks = nullptr;
    const swe_status created = swe_recurrent_create(&networks, &config, n, input_hidden.data(), context_hidden.data(),
                                                    hidden_output.data(), time_constants.data(), switches.data());
    try_out(bytes, created, networks, n, inputs, outputs);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Bytes bytes(data, size);
    if (bytes.below(4))
        try_recurrent(bytes);
    else
        try_linear(bytes);
    return 0;
}

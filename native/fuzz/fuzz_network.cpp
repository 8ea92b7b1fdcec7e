// SPDX-License-Identifier: BSD-3-Clause
// Networks of any size and weights: refused with a message, or their commands are computed from any observation.
#include <cstdlib>

#include "bytes.hpp"
#include "swarmevo.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Bytes bytes(data, size);
    swe_network_config config;
    swe_network_config_init(&config);
    if (bytes.below(16) == 0) config.struct_size = bytes.take<std::uint32_t>();
    config.hidden = bytes.below(64) ? static_cast<std::uint32_t>(bytes.below(20)) : bytes.take<std::uint32_t>();
    config.bias = bytes.below(16) ? static_cast<std::int32_t>(bytes.below(2)) : bytes.take<std::int32_t>();
    config.activation = bytes.below(16) ? 1 + static_cast<std::int32_t>(bytes.below(2)) : bytes.take<std::int32_t>();
    config.observations = bytes.below(64) ? static_cast<std::uint32_t>(bytes.below(20)) : bytes.take<std::uint32_t>();
    config.commands = bytes.below(64) ? static_cast<std::uint32_t>(bytes.below(4)) : bytes.take<std::uint32_t>();
    const std::size_t observations = std::min<std::size_t>(config.observations, 1024);
    const std::size_t commands = std::min<std::size_t>(config.commands, 1024);
    const std::size_t n = bytes.below(4), hidden = std::min<std::size_t>(config.hidden, 1024);
    const std::size_t bias = config.bias == 1;

    const auto input_hidden = bytes.numbers(n * hidden * (observations + bias));
    const auto hidden_output = bytes.numbers(n * commands * (hidden + bias));
    std::vector<std::uint8_t> switches(n * hidden);
    for (auto& on : switches) on = static_cast<std::uint8_t>(bytes.below(3));
    swe_networks* networks = nullptr;
    if (swe_networks_create(&networks, &config, n, input_hidden.data(), hidden_output.data(), switches.data()) !=
        SWE_OK) {
        if (networks || !*swe_error_message()) std::abort();
        return 0;
    }
    std::vector<swe_policy> policies(bytes.below(5));
    policies.reserve(1);  // never NULL, which is refused
    const bool fits = policies.size() == n;
    if ((swe_networks_policies(policies.data(), policies.size(), networks) == SWE_OK) != fits) std::abort();
    for (std::size_t i = 0; fits && i < n; ++i) {
        const auto observation = bytes.numbers(observations);
        std::vector<double> command(commands);
        policies[i].function(policies[i].parameters, observation.data(), nullptr, command.data());
    }
    swe_networks_destroy(networks);
    return 0;
}

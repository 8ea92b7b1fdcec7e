// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "networks/numbers.hpp"
#include "swarmevo.h"

namespace {

bool complains(const char* part) {
    return std::string(swe_error_message()).find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("a fresh config of a network is refused until all is set") {
    swe_networks* networks = nullptr;
    const double weights[1] = {0};
    const std::uint8_t on[1] = {1};
    swe_linear_config linear;
    swe_linear_config_init(&linear);
    CHECK(swe_linear_create(&networks, &linear, 1, weights) == SWE_INVALID_ARGUMENT);
    CHECK(complains("linear.observations"));
    swe_recurrent_config recurrent;
    swe_recurrent_config_init(&recurrent);
    CHECK(swe_recurrent_create(&networks, &recurrent, 1, weights, weights, weights, weights, on) ==
          SWE_INVALID_ARGUMENT);
    CHECK(complains("recurrent.observations"));
    recurrent.observations = recurrent.commands = recurrent.hidden = 1;
    recurrent.bias = 0;
    recurrent.activation = SWE_ACTIVATION_TANH;
    CHECK(swe_recurrent_create(&networks, &recurrent, 1, weights, weights, weights, weights, on) ==
          SWE_INVALID_ARGUMENT);
    CHECK(complains("recurrent.recurrence: not set"));
    recurrent.recurrence = SWE_RECURRENCE_CTRNN;
    CHECK(swe_recurrent_create(&networks, &recurrent, 1, weights, weights, weights, weights, on) ==
          SWE_INVALID_ARGUMENT);
    CHECK(complains("recurrent.integration: not set"));
    CHECK(!networks);
}

TEST_CASE("NULL for networks of any size is an error, but for time constants that are not read") {
    const std::vector<double> weights = random_numbers(100, 1);
    const std::uint8_t on[2] = {1, 1};
    const double* w = weights.data();
    swe_networks* networks = nullptr;
    const swe_linear_config linear{sizeof linear, 1, SWE_ACTIVATION_IDENTITY, 13, 2};
    CHECK(swe_linear_create(nullptr, &linear, 1, w) == SWE_INVALID_ARGUMENT);
    CHECK(swe_linear_create(&networks, nullptr, 1, w) == SWE_INVALID_ARGUMENT);
    CHECK(swe_linear_create(&networks, &linear, 1, nullptr) == SWE_INVALID_ARGUMENT);
    CHECK(complains("input_output: expected a pointer, got NULL"));

    swe_recurrent_config c{sizeof c, 2, 1, SWE_ACTIVATION_TANH, 13, 2, SWE_RECURRENCE_CTRNN, SWE_INTEGRATION_EULER,
                           0.1};
    CHECK(swe_recurrent_create(&networks, &c, 1, w, nullptr, w, w, on) == SWE_INVALID_ARGUMENT);
    CHECK(complains("context_hidden: expected a pointer"));
    CHECK(swe_recurrent_create(&networks, &c, 1, w, w, w, nullptr, on) == SWE_INVALID_ARGUMENT);
    CHECK(complains("time_constants: expected a pointer"));
    c.recurrence = SWE_RECURRENCE_JORDAN;
    REQUIRE(swe_recurrent_create(&networks, &c, 1, w, w, w, nullptr, on) == SWE_OK);
    swe_policy policies[2];
    CHECK(swe_networks_policies(policies, 2, networks) == SWE_INVALID_ARGUMENT);
    CHECK(complains("policies: expected 1 values, got 2"));
    REQUIRE(swe_networks_policies(policies, 1, networks) == SWE_OK);
    double memory[2] = {}, command[2];
    policies[0].function(policies[0].parameters, w, memory, command);
    CHECK(memory[0] == command[0]);
    swe_networks_destroy(networks);
}

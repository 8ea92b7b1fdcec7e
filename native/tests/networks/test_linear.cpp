// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "networks/linear.hpp"
#include "networks/numbers.hpp"

using namespace swarmevo;

namespace {

swe_linear_config config_of(unsigned inputs, unsigned outputs, int bias, int activation) {
    return {sizeof(swe_linear_config), bias, activation, inputs, outputs};
}

double activated(double sum, int activation) {
    if (activation == SWE_ACTIVATION_IDENTITY) return sum;
    return activation == SWE_ACTIVATION_TANH ? std::tanh(sum) : 2 / (1 + std::exp(-sum)) - 1;
}

}  // namespace

TEST_CASE("linear networks agree with the written-out sums, of any size") {
    for (const int activation : {SWE_ACTIVATION_TANH, SWE_ACTIVATION_LOGISTIC, SWE_ACTIVATION_IDENTITY})
        for (const unsigned bias : {0u, 1u})
            for (const unsigned inputs : {0u, 1u, 13u, 40u})
                for (const unsigned outputs : {1u, 2u, 5u}) {
                    constexpr std::size_t n = 3;
                    const std::size_t row = inputs + bias, size = outputs * row;
                    const auto weights = random_numbers(n * size + 1, 1), x = random_numbers(inputs + 1, 2);
                    const LinearNetworks networks(config_of(inputs, outputs, static_cast<int>(bias), activation), n,
                                                  weights.data());
                    REQUIRE(networks.size() == n);
                    for (std::size_t i = 0; i < n; ++i) {
                        const swe_policy policy = networks.policy(i);
                        CHECK(policy.memory == 0);
                        CHECK(policy.observations == inputs);
                        CHECK(policy.commands == outputs);
                        std::vector<double> got(outputs);
                        policy.function(policy.parameters, x.data(), nullptr, got.data());
                        for (std::size_t o = 0; o < outputs; ++o) {
                            const double* w = &weights[i * size + o * row];
                            double sum = bias ? w[inputs] : 0;
                            for (std::size_t j = 0; j < inputs; ++j) sum += w[j] * x[j];
                            CHECK(got[o] == doctest::Approx(activated(sum, activation)).epsilon(1e-12));
                        }
                    }
                }
}

TEST_CASE("a linear network with a weight that is not finite or a config out of range is refused") {
    std::vector<double> weights(2 * 2 * 14, 0.1);
    const auto create = [&](const swe_linear_config& c) { LinearNetworks(c, 2, weights.data()); };
    create(config_of(13, 2, 1, SWE_ACTIVATION_IDENTITY));
    CHECK_THROWS_WITH(create(config_of(1025, 2, 1, 1)), doctest::Contains("linear.observations: expected 0 to 1024"));
    CHECK_THROWS_WITH(create(config_of(13, 0, 1, 1)), doctest::Contains("linear.commands: expected 1 to 1024, got 0"));
    CHECK_THROWS_WITH(create(config_of(13, 2, -1, 1)), doctest::Contains("linear.bias"));
    CHECK_THROWS_WITH(create(config_of(13, 2, 1, 4)), doctest::Contains("linear.activation"));
    auto older = config_of(13, 2, 1, 1);
    older.struct_size -= 1;
    CHECK_THROWS_WITH(create(older), doctest::Contains("struct_size"));
    weights[2 * 14] = INFINITY;
    CHECK_THROWS_WITH(create(config_of(13, 2, 1, 1)), doctest::Contains("in network 1"));
}

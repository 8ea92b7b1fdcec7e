// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "error.hpp"
#include "networks/numbers.hpp"
#include "policy.hpp"

using namespace swarmevo;

namespace {

swe_network_config config_of(unsigned hidden, int bias, int activation) {
    return {sizeof(swe_network_config), hidden, bias, activation, 13, 2};
}

// Reference: the sums as one would write them down, all units visited.
void forward(const swe_network_config& c, const double* ih, const double* ho, const std::uint8_t* on, const double* x,
             double* out) {
    const bool is_tanh = c.activation == SWE_ACTIVATION_TANH;
    const int inputs = 13 + c.bias, units = static_cast<int>(c.hidden) + c.bias;
    for (int o = 0; o < 2; ++o) {
        double sum = c.bias ? ho[o * units + static_cast<int>(c.hidden)] : 0;
        for (int h = 0; h < static_cast<int>(c.hidden); ++h) {
            if (!on[h]) continue;
            double net = c.bias ? ih[h * inputs + 13] : 0;
            for (int i = 0; i < 13; ++i) net += ih[h * inputs + i] * x[i];
            sum += ho[o * units + h] * (is_tanh ? std::tanh(net) : 1 / (1 + std::exp(-net)));
        }
        out[o] = is_tanh ? std::tanh(sum) : 2 / (1 + std::exp(-sum)) - 1;
    }
}

}  // namespace

TEST_CASE("networks agree with the written-out sums, whatever is switched on") {
    for (const int activation : {SWE_ACTIVATION_TANH, SWE_ACTIVATION_LOGISTIC})
        for (const int bias : {0, 1})
            for (const unsigned hidden : {0u, 1u, 15u, 40u}) {
                constexpr std::size_t n = 8;
                const auto c = config_of(hidden, bias, activation);
                const std::size_t size_ih = hidden * (13 + bias), size_ho = 2 * (hidden + bias);
                const auto ih = random_numbers(n * size_ih + 1, 1), ho = random_numbers(n * size_ho + 1, 2);
                const auto x = random_numbers(13, 3), coin = random_numbers(n * hidden + 1, 4);
                std::vector<std::uint8_t> on;
                for (const double number : coin) on.push_back(number > 0);
                const Networks networks(c, n, ih.data(), ho.data(), on.data());
                for (std::size_t i = 0; i < n; ++i) {
                    double expected[2], got[2];
                    forward(c, &ih[i * size_ih], &ho[i * size_ho], &on[i * hidden], x.data(), expected);
                    const swe_policy policy = networks.policy(i);
                    policy.function(policy.parameters, x.data(), nullptr, got);
                    CHECK(got[0] == doctest::Approx(expected[0]).epsilon(1e-12));
                    CHECK(got[1] == doctest::Approx(expected[1]).epsilon(1e-12));
                }
            }
}

TEST_CASE("a weight that is not finite and a config out of range are refused") {
    std::vector<double> ih(2 * 15 * 14, 0.1), ho(2 * 2 * 16, 0.1);
    const std::vector<std::uint8_t> on(2 * 15, 1);
    const auto create = [&](const swe_network_config& c) { Networks(c, 2, ih.data(), ho.data(), on.data()); };
    create(config_of(15, 1, SWE_ACTIVATION_TANH));
    CHECK_THROWS_WITH(create(config_of(1025, 1, 1)), doctest::Contains("network.hidden"));
    CHECK_THROWS_WITH(create(config_of(15, 2, 1)), doctest::Contains("network.bias"));
    CHECK_THROWS_WITH(create(config_of(15, 1, 0)), doctest::Contains("network.activation"));
    ih[15 * 14 + 3] = NAN;
    CHECK_THROWS_WITH(create(config_of(15, 1, 1)), doctest::Contains("in network 1"));
}

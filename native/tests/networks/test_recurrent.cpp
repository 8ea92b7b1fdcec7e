// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <cmath>
#include <string>
#include <vector>

#include "networks/numbers.hpp"
#include "networks/recurrent.hpp"

using namespace swarmevo;

namespace {

constexpr double kPeriod = 0.1;  // [s]

swe_recurrent_config config_of(int recurrence, unsigned hidden = 7, int bias = 1,
                               int activation = SWE_ACTIVATION_TANH) {
    return {sizeof(swe_recurrent_config), hidden, bias, activation, 5, 3, recurrence,
            SWE_INTEGRATION_EXPONENTIAL,  kPeriod};
}

// Weights of n networks, and what is on of them.
struct Weights {
    std::vector<double> ih, ch, ho, tau;
    std::vector<std::uint8_t> on;

    Weights(const swe_recurrent_config& c, std::size_t n) {
        const std::size_t bias = c.bias == 1, hidden = c.hidden;
        ih = random_numbers(n * hidden * (c.observations + bias) + 1, 1);
        ch = random_numbers(n * hidden * std::max(c.hidden, c.commands) + 1, 2);
        ho = random_numbers(n * c.commands * (hidden + bias) + 1, 3);
        for (const double number : random_numbers(n * hidden + 1, 4)) tau.push_back(kPeriod * std::exp(number));
        for (const double number : random_numbers(n * hidden + 1, 5)) on.push_back(number > -0.5);
    }

    RecurrentNetworks networks(const swe_recurrent_config& c, std::size_t n) const {
        return RecurrentNetworks(c, n, ih.data(), ch.data(), ho.data(), tau.data(), on.data());
    }
};

// Reference: one network as one would write it down, all units visited, the memory of a unit that is off staying 0.
class WrittenOut {
  public:
    WrittenOut(const swe_recurrent_config& c, const Weights& w, std::size_t i)
        : c_(c), bias_(c.bias == 1), context_size_(c.recurrence == SWE_RECURRENCE_JORDAN ? c.commands : c.hidden) {
        ih_ = &w.ih[i * c.hidden * (c.observations + bias_)];
        ch_ = &w.ch[i * c.hidden * context_size_];
        ho_ = &w.ho[i * c.commands * (c.hidden + bias_)];
        tau_ = &w.tau[i * c.hidden];
        on_ = &w.on[i * c.hidden];
        context_.assign(context_size_, 0.0);
        y_.assign(c.hidden, 0.0);
    }

    std::vector<double> act(const std::vector<double>& x) {
        std::vector<double> h(c_.hidden, 0.0), before = context_;
        if (is_ctrnn())
            for (std::size_t u = 0; u < c_.hidden; ++u) before[u] = on_[u] ? squashed(y_[u] + theta(u)) : 0;
        for (std::size_t u = 0; u < c_.hidden; ++u) {
            if (!on_[u]) continue;
            double heard = is_ctrnn() ? 0 : theta(u);
            for (std::size_t j = 0; j < c_.observations; ++j) heard += ih_[u * (c_.observations + bias_) + j] * x[j];
            for (std::size_t k = 0; k < context_size_; ++k) heard += ch_[u * context_size_ + k] * before[k];
            if (is_ctrnn()) {
                if (c_.integration == SWE_INTEGRATION_EULER)
                    y_[u] += kPeriod / tau_[u] * (-y_[u] + heard);
                else  // tau dy/dt = -y + heard, solved
                    y_[u] = heard + (y_[u] - heard) * std::exp(-kPeriod / tau_[u]);
                heard = y_[u] + theta(u);
            }
            h[u] = squashed(heard);
        }
        std::vector<double> out(c_.commands);
        for (std::size_t o = 0; o < c_.commands; ++o) {
            const double* w = &ho_[o * (c_.hidden + bias_)];
            double sum = bias_ ? w[c_.hidden] : 0;
            for (std::size_t u = 0; u < c_.hidden; ++u) sum += w[u] * h[u];
            out[o] = c_.activation == SWE_ACTIVATION_TANH ? std::tanh(sum) : 2 / (1 + std::exp(-sum)) - 1;
        }
        context_ = c_.recurrence == SWE_RECURRENCE_JORDAN ? out : h;
        return out;
    }

  private:
    bool is_ctrnn() const { return c_.recurrence == SWE_RECURRENCE_CTRNN; }
    double theta(std::size_t u) const { return bias_ ? ih_[u * (c_.observations + 1) + c_.observations] : 0; }
    double squashed(double x) const {
        return c_.activation == SWE_ACTIVATION_TANH ? std::tanh(x) : 1 / (1 + std::exp(-x));
    }

    swe_recurrent_config c_;
    std::size_t bias_, context_size_;
    const double *ih_, *ch_, *ho_, *tau_;
    const std::uint8_t* on_;
    std::vector<double> context_, y_;
};

void check_against_reference(const swe_recurrent_config& c) {
    constexpr std::size_t n = 4;
    Weights weights(c, n);
    if (c.integration == SWE_INTEGRATION_EULER)
        for (double& tau : weights.tau) tau += kPeriod;
    const RecurrentNetworks networks = weights.networks(c, n);
    for (std::size_t i = 0; i < n; ++i) {
        WrittenOut reference(c, weights, i);
        const swe_policy policy = networks.policy(i);
        CHECK(policy.observations == c.observations);
        CHECK(policy.commands == c.commands);
        std::vector<double> memory(policy.memory), got(c.commands);
        for (unsigned step = 0; step < 20; ++step) {
            const auto x = random_numbers(c.observations, 100 + step);
            policy.function(policy.parameters, x.data(), memory.data(), got.data());
            const auto expected = reference.act(x);
            for (std::size_t o = 0; o < c.commands; ++o)
                CHECK(got[o] == doctest::Approx(expected[o]).epsilon(1e-9));  // small differences grow with the steps
        }
    }
}

}  // namespace

TEST_CASE("recurrent networks agree with the written-out sums, step after step, whatever is switched on") {
    for (const int recurrence : {SWE_RECURRENCE_ELMAN, SWE_RECURRENCE_JORDAN, SWE_RECURRENCE_CTRNN})
        for (const int activation : {SWE_ACTIVATION_TANH, SWE_ACTIVATION_LOGISTIC})
            for (const int bias : {0, 1})
                for (const unsigned hidden : {0u, 1u, 7u, 40u})
                    for (const int integration : {SWE_INTEGRATION_EXPONENTIAL, SWE_INTEGRATION_EULER}) {
                        auto c = config_of(recurrence, hidden, bias, activation);
                        c.integration = integration;
                        check_against_reference(c);
                    }
}

TEST_CASE("memory is as large as what is remembered, units that are off left out") {
    Weights weights(config_of(SWE_RECURRENCE_ELMAN), 1);
    weights.on = {1, 0, 1, 1, 0, 0, 1};
    for (const int recurrence : {SWE_RECURRENCE_ELMAN, SWE_RECURRENCE_JORDAN, SWE_RECURRENCE_CTRNN}) {
        const RecurrentNetworks networks = weights.networks(config_of(recurrence), 1);
        CHECK(networks.policy(0).memory == (recurrence == SWE_RECURRENCE_JORDAN ? 3 : 4));
    }
}

TEST_CASE("a recurrent network with numbers that cannot be or a config out of range is refused") {
    const swe_recurrent_config sound = config_of(SWE_RECURRENCE_CTRNN);
    Weights weights(sound, 2);
    const auto create = [&](const swe_recurrent_config& c) { weights.networks(c, 2); };
    const auto with = [&](auto change) {
        swe_recurrent_config c = sound;
        change(c);
        return c;
    };
    create(sound);
    CHECK_THROWS_WITH(create(with([](auto& c) { c.struct_size = 8; })), doctest::Contains("struct_size"));
    CHECK_THROWS_WITH(create(with([](auto& c) { c.observations = 1025; })),
                      doctest::Contains("recurrent.observations"));
    CHECK_THROWS_WITH(create(with([](auto& c) { c.commands = 0; })), doctest::Contains("recurrent.commands"));
    CHECK_THROWS_WITH(create(with([](auto& c) { c.hidden = 1025; })), doctest::Contains("recurrent.hidden"));
    CHECK_THROWS_WITH(create(with([](auto& c) { c.bias = 2; })), doctest::Contains("recurrent.bias"));
    CHECK_THROWS_WITH(create(with([](auto& c) { c.activation = SWE_ACTIVATION_IDENTITY; })),
                      doctest::Contains("recurrent.activation"));
    CHECK_THROWS_WITH(create(with([](auto& c) { c.recurrence = -1; })), doctest::Contains("recurrent.recurrence"));
    CHECK_THROWS_WITH(create(with([](auto& c) { c.integration = 3; })), doctest::Contains("recurrent.integration"));
    for (const double period : {0.0, -0.1, double(NAN), double(INFINITY)})
        CHECK_THROWS_WITH(create(with([&](auto& c) { c.control_period = period; })),
                          doctest::Contains("recurrent.control_period"));
    for (const double tau : {0.0, -1.0, double(NAN), double(INFINITY)}) {
        weights.tau[3] = tau;
        CHECK_THROWS_WITH(create(sound), doctest::Contains("time_constants"));
        create(config_of(SWE_RECURRENCE_ELMAN));  // does not read them
    }
    weights.tau[3] = 0.99 * kPeriod;
    create(sound);
    CHECK_THROWS_WITH(create(with([](auto& c) { c.integration = SWE_INTEGRATION_EULER; })),
                      doctest::Contains("at least the control period"));
    weights.ch[7 * 7] = NAN;
    CHECK_THROWS_WITH(create(sound),
                      doctest::Contains("context_hidden: expected finite weights, got nan in network 1"));
}

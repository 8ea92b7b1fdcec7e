// SPDX-License-Identifier: BSD-3-Clause
// What networks of every kind are made of: weighted sums, activations, and checks of what comes from outside.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

#include "error.hpp"
#include "swarmevo.h"

namespace swarmevo {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Units and the weights of what they hear; biases are 0 where there are none.
struct Layer {
    Eigen::MatrixXd weights;  // (units, inputs)
    Eigen::VectorXd bias;     // (units)
};

// Of rows whose last entry is the bias if there is one.
inline Layer make_layer(const Eigen::Ref<const RowMajor>& rows, std::int32_t has_bias) {
    Layer layer{rows.leftCols(rows.cols() - has_bias), Eigen::VectorXd::Zero(rows.rows())};
    if (has_bias && rows.rows() > 0) layer.bias = rows.rightCols<1>();  // without rows there is no data to point into
    return layer;
}

// sums += weights * inputs, one input after the other: C that adds in this order has the same bits.
template <typename Sums, typename Inputs>
void add_weighted(Sums& sums, const Eigen::MatrixXd& weights, const Inputs& inputs) {
    for (Eigen::Index i = 0; i < weights.cols(); ++i) sums += weights.col(i) * inputs[i];
}

inline double logistic(double x) {
    return 1 / (1 + std::exp(-x));
}

inline double activated_hidden(double x, int activation) {
    return activation == SWE_ACTIVATION_TANH ? std::tanh(x) : logistic(x);
}

inline double activated_output(double x, int activation) {
    if (activation == SWE_ACTIVATION_IDENTITY) return x;
    return activation == SWE_ACTIVATION_TANH ? std::tanh(x) : 2 * logistic(x) - 1;
}

// Throws Error(SWE_INVALID_ARGUMENT) unless value is from least to most.
inline void check_count(const char* name, std::uint32_t value, std::uint32_t least, std::uint32_t most) {
    if (value < least || value > most)
        throw Error(SWE_INVALID_ARGUMENT, std::string(name) + ": expected " + std::to_string(least) + " to " +
                                              std::to_string(most) + ", got " + std::to_string(value));
}

// Throws Error(SWE_INVALID_ARGUMENT) for the first of n networks with a number that is not finite; `size` of each.
inline void check_finite(const double* numbers, std::size_t n, std::size_t size, const char* name) {
    for (std::size_t i = 0; i < n * size; ++i)
        if (!std::isfinite(numbers[i]))
            throw Error(SWE_INVALID_ARGUMENT, std::string(name) + ": expected finite weights, got " +
                                                  std::to_string(numbers[i]) + " in network " +
                                                  std::to_string(i / size));
}

}  // namespace swarmevo

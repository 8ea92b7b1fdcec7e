// SPDX-License-Identifier: BSD-3-Clause
// Values from a fuzzer's bytes; zeros when they are used up.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

class Bytes {
  public:
    Bytes(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}

    bool empty() const { return left_ == 0; }

    template <class T>
    T take() {
        T value{};
        const std::size_t n = std::min(left_, sizeof(T));
        std::memcpy(&value, data_, n);
        data_ += n;
        left_ -= n;
        return value;
    }

    // A byte below `end`.
    std::size_t below(std::size_t end) { return take<std::uint8_t>() % end; }

    // Mostly what belongs there, sometimes any double at all.
    double number() {
        const auto kind = take<std::uint8_t>();
        if (kind % 8 == 0) return take<double>();
        return take<std::int16_t>() / 4096.0;
    }

    std::vector<double> numbers(std::size_t n) {
        std::vector<double> values(n);
        values.reserve(1);  // never NULL, which is refused
        for (double& value : values) value = number();
        return values;
    }

  private:
    const std::uint8_t* data_;
    std::size_t left_;
};

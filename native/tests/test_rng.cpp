// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <set>

#include "rng.hpp"

using namespace swarmevo;

TEST_CASE("Philox gives the known answers of its authors (Random123, kat_vectors)") {
    using Words = std::array<std::uint32_t, 4>;
    CHECK(philox4x32({0, 0, 0, 0}, {0, 0}) == Words{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8});
    CHECK(philox4x32({0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff}, {0xffffffff, 0xffffffff}) ==
          Words{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd});
    CHECK(philox4x32({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}) ==
          Words{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1});
}

TEST_CASE("every part of a key makes another stream") {
    std::set<std::array<std::uint32_t, 4>> seen;
    unsigned drawn = 0;
    const auto note = [&](const EpisodeKey& key, Purpose purpose, unsigned robot, unsigned step, unsigned block) {
        seen.insert(draw(key, purpose, robot, step, block));
        ++drawn;
    };
    note({1, 2, 3, 4}, Purpose::infrared, 5, 6, 7);
    note({2, 2, 3, 4}, Purpose::infrared, 5, 6, 7);
    note({1 + (std::uint64_t{1} << 32), 2, 3, 4}, Purpose::infrared, 5, 6, 7);
    note({1, 3, 3, 4}, Purpose::infrared, 5, 6, 7);
    note({1, 2, 4, 4}, Purpose::infrared, 5, 6, 7);
    note({1, 2, 3, 5}, Purpose::infrared, 5, 6, 7);
    note({1, 2, 3, 4}, Purpose::wheels, 5, 6, 7);
    note({1, 2, 3, 4}, Purpose::infrared, 6, 6, 7);
    note({1, 2, 3, 4}, Purpose::infrared, 5, 7, 7);
    note({1, 2, 3, 4}, Purpose::infrared, 5, 6, 8);
    CHECK(seen.size() == drawn);
}

TEST_CASE("uniform and normal draws have the moments of their distributions") {
    constexpr unsigned n = 100000;
    double uniform_sum = 0, normal_sum = 0, normal_squares = 0;
    for (unsigned i = 0; i < n; ++i) {
        const auto words = draw({7, 0, 0, 0}, Purpose::rf, 0, i);
        const double u = uniform(words[0]), z = normal(words[1], words[2]);
        REQUIRE((u > 0 && u < 1));
        uniform_sum += u;
        normal_sum += z;
        normal_squares += z * z;
    }
    CHECK(uniform_sum / n == doctest::Approx(0.5).epsilon(0.01));
    CHECK(normal_sum / n == doctest::Approx(0).scale(1).epsilon(0.02));
    CHECK(normal_squares / n == doctest::Approx(1).epsilon(0.02));
}

// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <atomic>
#include <vector>

#include "pool.hpp"

using namespace swarmevo;

TEST_CASE("every index is visited once, on any number of threads, again and again") {
    for (const unsigned threads : {1u, 2u, 8u}) {
        Pool pool(threads);
        for (const std::size_t n : {0u, 1u, 7u, 1000u}) {
            std::vector<std::atomic<int>> visits(n);
            pool.for_each(n, [&](std::size_t i) { ++visits[i]; });
            for (const auto& count : visits) CHECK(count == 1);
        }
    }
}

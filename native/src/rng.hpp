// SPDX-License-Identifier: BSD-3-Clause
// Counter-based random streams: a draw is a pure function of its key, so no order of execution can change it.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

namespace swarmevo {

// Philox-4x32 with ten rounds. Source: Salmon et al., "Parallel random numbers: as easy as 1, 2, 3", SC 2011.
inline std::array<std::uint32_t, 4> philox4x32(std::array<std::uint32_t, 4> counter, std::array<std::uint32_t, 2> key) {
    constexpr std::uint64_t kMultiplier0 = 0xD2511F53, kMultiplier1 = 0xCD9E8D57;
    constexpr std::uint32_t kWeyl0 = 0x9E3779B9, kWeyl1 = 0xBB67AE85;
    for (int round = 0; round < 10; ++round) {
        const std::uint64_t p0 = kMultiplier0 * counter[0], p1 = kMultiplier1 * counter[2];
        counter = {static_cast<std::uint32_t>(p1 >> 32) ^ counter[1] ^ key[0], static_cast<std::uint32_t>(p1),
                   static_cast<std::uint32_t>(p0 >> 32) ^ counter[3] ^ key[1], static_cast<std::uint32_t>(p0)};
        key[0] += kWeyl0;
        key[1] += kWeyl1;
    }
    return counter;
}

// What a draw is for: streams of different purposes never meet.
enum class Purpose : std::uint32_t {
    start = 1,
    infrared = 2,
    wheels = 3,
    rf = 4,
    movable_start = 5,
    rf_bearing = 16,
    range_and_bearing = 17,
    ground = 18,
    odometry = 19,
    light = 20,
};

// The key of one episode's streams.
struct EpisodeKey {
    std::uint64_t seed;
    std::uint32_t trial;  // below 2^16
    std::uint32_t generation;
    std::uint32_t repeat;  // below 2^16
};

// Four random words for (episode, purpose, robot, step, block).
inline std::array<std::uint32_t, 4> draw(const EpisodeKey& key, Purpose purpose, std::uint32_t robot,
                                         std::uint32_t step, std::uint32_t block = 0) {
    return philox4x32({step, robot << 16 | static_cast<std::uint32_t>(purpose) << 8 | block, key.generation,
                       key.trial << 16 | key.repeat},
                      {static_cast<std::uint32_t>(key.seed), static_cast<std::uint32_t>(key.seed >> 32)});
}

// Uniform in (0, 1).
inline double uniform(std::uint32_t word) {
    return (word + 0.5) * 0x1p-32;
}

// Uniform in (-1, 1).
inline double symmetric(std::uint32_t word) {
    return 2 * uniform(word) - 1;
}

// One draw of N(0, 1) from two words (Box and Muller 1958).
inline double normal(std::uint32_t a, std::uint32_t b) {
    constexpr double kTwoPi = 6.283185307179586;
    return std::sqrt(-2 * std::log(uniform(a))) * std::cos(kTwoPi * uniform(b));
}

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
// What sensors look at: a moment of the world, and one robot in it.
#pragma once

#include <array>
#include <vector>

#include "rng.hpp"
#include "scene/scene.hpp"

namespace swarmevo {

// Everything that sensors need to know about a moment. What no device of the scene reads may be left empty.
struct Snapshot {
    std::vector<Pose> robots, movables;
    std::vector<double> push_forces = {};   // (robots, movables): normal force on each in the last step [N]
    std::vector<Twist> motions = {};        // (movables)
    std::vector<double> wheel_speeds = {};  // (robots, 2): left and right [rad/s]
    std::vector<double> messages = {};      // (robots, message bits): sent in the last control step, each 0 or 1
};

// A moment as one robot's devices see it: a pure function of geometry and random draws.
struct Glimpse {
    const Scene& scene;
    const Snapshot& now;
    const EpisodeKey& key;
    unsigned step, robot;

    const Pose& me() const { return now.robots[robot]; }

    std::array<std::uint32_t, 4> draw(Purpose purpose, std::uint32_t block = 0) const {
        return swarmevo::draw(key, purpose, robot, step, block);
    }
};

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
// One simulated world: rigid bodies in three dimensions, stepped by Open Dynamics Engine. Only the files in
// world/ know ODE.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "epuck.hpp"
#include "scene/scene.hpp"

namespace swarmevo {

// The worst that happened so far.
struct Extremes {
    double penetration = 0;  // deepest overlap [m]
    double lift = 0;         // largest rise of a centre above its resting height [m]
    double upright = 1;      // smallest cosine of a body's tilt
};

// Where all begins.
struct Starts {
    std::vector<Pose> robots, movables;
};

class World {
  public:
    World(const Scene& scene, const Starts& starts);
    ~World();
    World(const World&) = delete;
    World& operator=(const World&) = delete;

    // Rim speeds hold until set anew [m/s].
    void set_rim_speeds(unsigned robot, double left, double right);

    // Advances by one time step. Throws Error(SWE_PHYSICS_ERROR); the world is then of no more use.
    void step();

    Pose robot_pose(unsigned robot) const;
    Pose movable_pose(unsigned movable) const;
    Twist movable_motion(unsigned movable) const;

    // Of a wheel about its axle, as an encoder would measure it [rad/s].
    double wheel_speed(unsigned robot, Side side) const;

    // Normal force of a robot on a movable in the last step [N]; recorded where sensors need it.
    double push_force(unsigned robot, unsigned movable) const;

    // Sum over all bodies, potential energy above rest and kinetic [J].
    double energy() const;

    // Folds every body's state into `hash`. Throws Error(SWE_PHYSICS_ERROR) if a state is not finite.
    std::uint64_t fold_state(std::uint64_t hash) const;

    const Extremes& extremes() const;
    unsigned ode_messages() const;    // warnings of ODE's solver; each makes the step be tried again
    unsigned unsolved_steps() const;  // steps that no further try mended

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

// Provokes an assertion of ODE; throws Error(SWE_PHYSICS_ERROR) if it is caught as it should.
void provoke_ode_assertion();

// "ODE 0.16.2, double precision"
const char* ode_description();

}  // namespace swarmevo

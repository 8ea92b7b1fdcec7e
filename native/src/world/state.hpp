// SPDX-License-Identifier: BSD-3-Clause
// What a step works on: the bodies of a world, how they are driven, and what finds and solves their contacts.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "scene/scene.hpp"
#include "world/average.hpp"
#include "world/compliant.hpp"
#include "world/contacts.hpp"
#include "world/drive.hpp"
#include "world/movable.hpp"
#include "world/ode.hpp"
#include "world/sides.hpp"
#include "world/world.hpp"

namespace swarmevo {

// How a robot gets through the step that is tried.
enum class Role {
    solved,  // by the solver
    coasts,  // in closed form
    rests,   // it stays as it is
};

struct Robot {
    int number = 0;  // of its body in State::average
    std::unique_ptr<Drive> drive;
    std::vector<double> resting_heights;  // of its bodies [m]
    bool is_steady = false;               // its rim speeds are those of the last step
    // In the step that is tried:
    bool is_free = true;  // nothing but the floor is near
    Role role = Role::solved;
};

struct State {
    State(const Scene& description, const Starts& starts);
    State(const State&) = delete;  // its parts refer to each other
    State& operator=(const State&) = delete;

    // Rim speeds hold until set anew [m/s].
    void set_rim_speeds(unsigned robot, double left, double right);

    // Sum over all bodies, potential energy above rest and kinetic [J].
    double energy() const;

    // Folds every body's state into `hash`. Throws Error(SWE_PHYSICS_ERROR) if a state is not finite.
    std::uint64_t fold_into(std::uint64_t hash) const;

    const Scene& scene;
    const bool is_level;  // all bodies stay so, and their loads are known: the driven contacts
    OdeWorld ode;
    Contacts contacts;
    AverageVelocity average;
    Sides sides;
    CompliantStep compliant;
    std::vector<Robot> robots;
    std::vector<Movable> movables;
    std::vector<dBodyID> bodies;  // all

  private:
    void add_robot(Robot& robot, int number, const Pose& start);
};

}  // namespace swarmevo

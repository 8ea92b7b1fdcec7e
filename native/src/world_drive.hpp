// SPDX-License-Identifier: BSD-3-Clause
// How a robot is built and driven inside ODE. Two models of the same robot:
//
//   DrivenContacts  one rigid body that stays level, half its weight on each wheel. Each wheel is a contact whose
//   surface
//                   runs backwards at its rim's speed.
//   Articulated     the reference, free in all three dimensions: a chassis on casters and two wheel bodies on hinges
//   with
//                   torque-limited velocity motors. Slower by the bodies, contacts and joints that it adds, and true
//                   only at small time steps.
#pragma once

#include <memory>
#include <vector>

#include "world_ode.hpp"

namespace swarmevo {

class Drive {
  public:
    virtual ~Drive() = default;

    // Holds until set anew; rim speeds in [m/s].
    virtual void set_rim_speeds(double left, double right) = 0;

    // Contacts of wheels and casters with the floor in a step of this length [s]. `is_free`: nothing else touches the
    // robot in it.
    virtual void add_floor_contacts(Contacts& contacts, double time_step, bool is_free) = 0;

    // Where its wheels want to take it, on the floor [m/s].
    virtual Vector intended_velocity() const = 0;

    // Nothing but the floor is near. Can the coming step be taken in closed form?
    virtual bool can_coast(double time_step) const = 0;

    // Takes it, without ODE.
    virtual void coast(double time_step) = 0;

    // After a step of this length [s].
    virtual void finish(double time_step) = 0;

    // All its bodies; the first is the one that robots and box run into, its pose is the robot's.
    const std::vector<dBodyID>& bodies() const { return bodies_; }
    dBodyID body() const { return bodies_.front(); }

  protected:
    std::vector<dBodyID> bodies_;
};

// Robot of scene.physics.drive's kind, at rest.
std::unique_ptr<Drive> create_drive(const Scene& scene, dWorldID world, const Pose& start);

}  // namespace swarmevo

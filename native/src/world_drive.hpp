// SPDX-License-Identifier: BSD-3-Clause
// How a robot is built and driven inside ODE. Two models of the same robot:
//
//   - Driven contacts: one rigid body that stays level; what its wheels carry follows from statics. Each wheel is a
//     contact whose surface runs backwards at its rim's speed.
//   - Articulated, the reference: free in three dimensions, a chassis on casters and two wheel bodies on hinges with
//     torque-limited velocity motors. Slower by the bodies, contacts and joints that it adds, and true at small time
//     steps only.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "world_grip.hpp"
#include "world_ode.hpp"

namespace swarmevo {

class Drive {
  public:
    explicit Drive(const Scene& scene)
        : scene_(scene), grips_{Grip(scene.physics.time_step), Grip(scene.physics.time_step)} {}
    virtual ~Drive() = default;
    Drive(const Drive&) = delete;
    Drive& operator=(const Drive&) = delete;

    // Holds until set anew; rim speeds in [m/s].
    virtual void set_rim_speeds(double left_speed, double right_speed) { rim_speeds_ = {left_speed, right_speed}; }

    // Before a step is laid out, maybe not for the first time.
    virtual void forget() {}

    // Contacts of wheels and casters with the floor in a step of this length [s]. `is_free`: nothing else touches the
    // robot in it.
    virtual void add_floor_contacts(Contacts& contacts, double time_step, bool is_free) = 0;

    // Wheels that slip may be given their friction as a force, for a solver with fewer rows. Did all of them go on
    // slipping as they did? If not, the step is to be taken back; their friction is then solved for until finish().
    virtual bool slips_as_assumed() = 0;

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
    const Scene& scene_;
    std::vector<dBodyID> bodies_;
    std::array<double, 2> rim_speeds_{};
    std::array<Grip, 2> grips_;  // of the wheels
};

std::unique_ptr<Drive> create_driven_contacts(const Scene& scene, dWorldID world, const Pose& start);
std::unique_ptr<Drive> create_articulated(const Scene& scene, dWorldID world, const Pose& start);

// Robot of scene.physics.drive's kind, at rest.
std::unique_ptr<Drive> create_drive(const Scene& scene, dWorldID world, const Pose& start);

}  // namespace swarmevo

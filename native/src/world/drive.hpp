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

#include "world/contacts.hpp"
#include "world/limit_curve.hpp"
#include "world/rub.hpp"

namespace swarmevo {

class CompliantStep;

class Drive {
  public:
    explicit Drive(const Scene& scene) : scene_(scene) {}
    virtual ~Drive() = default;
    Drive(const Drive&) = delete;
    Drive& operator=(const Drive&) = delete;

    // Holds until set anew; rim speeds in [m/s].
    virtual void set_rim_speeds(double left_speed, double right_speed) { rim_speeds_ = {left_speed, right_speed}; }

    // About its axle [rad/s].
    virtual double wheel_speed(Side side) const { return rim_speeds_[side] / scene_.robot.wheel_radius; }

    // By how much other rim speeds differ from those that hold, both wheels together [m/s].
    double speed_change(double left_speed, double right_speed) const {
        return std::abs(left_speed - rim_speeds_[left]) + std::abs(right_speed - rim_speeds_[right]);
    }

    // Before a step is laid out for the first time: wheels are expected to slip as they do now.
    void expect() { expects_ = true; }

    // Wheels and casters on the floor, where contacts find the robot.
    virtual void add_to(CompliantStep& step, const Place& place) = 0;
    virtual void add_to(Contacts& contacts, const Place& place) = 0;

    // Loads on the wheels follow from their friction, left and right, x and y [N]. Did that change what it may be?
    virtual bool share_loads(const double (&forces)[2][2]) = 0;

    // After a step of ODE: was the friction of all wheels Coulomb's? If not, the step is to be laid out anew, with what
    // this one showed.
    virtual bool fits() = 0;

    // Where its wheels want to take it.
    virtual Twist intended_motion() const = 0;

    // Did no wheel slip in the last step?
    bool sticks() const { return rubs_[left].sticks() && rubs_[right].sticks(); }

    // Nothing but the floor is near. Can the coming step be taken in closed form?
    virtual bool can_coast(double time_step) const = 0;

    // Takes it, without ODE.
    virtual void coast(double time_step) = 0;

    // After a step of ODE that holds.
    virtual void finish() = 0;

    // All its bodies; the first is the one that robots and box run into, its pose is the robot's.
    const std::vector<dBodyID>& bodies() const { return bodies_; }
    dBodyID body() const { return bodies_.front(); }

  protected:
    const Scene& scene_;
    std::vector<dBodyID> bodies_;
    std::array<double, 2> rim_speeds_{};
    std::array<Rub, 2> rubs_;  // of the wheels
    bool expects_ = false;
};

std::unique_ptr<Drive> create_driven_contacts(const Scene& scene, dWorldID world, const Pose& start);
std::unique_ptr<Drive> create_articulated(const Scene& scene, dWorldID world, const Pose& start);

// Robot of scene.physics.drive's kind, at rest.
std::unique_ptr<Drive> create_drive(const Scene& scene, dWorldID world, const Pose& start);

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
// ODE made safe: errors that throw, worlds that own their threading, contacts from closed formulas.
// Only the files world*.cpp know ODE.
#pragma once

#include <ode/ode.h>

#include "epuck.hpp"
#include "scene.hpp"

namespace swarmevo {

// A world with a threading implementation of its own: worlds on ODE's default one share it and crash side by side.
// Throws Error(SWE_OUT_OF_MEMORY).
class OdeWorld {
  public:
    OdeWorld();
    ~OdeWorld();
    OdeWorld(const OdeWorld&) = delete;
    OdeWorld& operator=(const OdeWorld&) = delete;

    // Advances by a time step. Returns how often ODE's solver gave a warning. Throws Error(SWE_PHYSICS_ERROR).
    unsigned step(double time_step);

    dWorldID id() const { return id_; }
    bool is_broken() const { return broken_; }  // a step failed: nothing in it may be touched any more

  private:
    dWorldID id_;
    dThreadingImplementationID threading_;
    bool broken_ = false;
};

// The state of one body.
struct BodyState {
    double position[3], quaternion[4], velocity[3], spin[3];
};

BodyState state_of(dBodyID body);
void set_state(dBodyID body, const BodyState& state);
Pose pose_of(dBodyID body);

// A body at rest, pitched about its own y axis (nose down is positive) and then turned by its heading [rad].
dBodyID create_body(dWorldID world, const Vector& position, double heading, double pitch, const dMass& mass);

// A body at rest that stays level: its supports carry it without being solved for. Neither gravity nor any torque tilts
// it.
dBodyID create_level_body(dWorldID world, const Vector& position, double heading, double mass, double vertical_inertia);

Vector axis(dBodyID body, int column);               // a column of its rotation matrix: its own x, y or z in the world
Vector to_world(dBodyID body, const Vector& local);  // a point of the body

// By how much one of two equal limits of friction is to exceed the other, relatively: surfaces that slip in the same
// instant tie rows of the contact problem, and ODE's solver stalls. Far above rounding, far below any figure of
// friction.
constexpr double kTieBreak = 1e-9;

// How two surfaces rub. Friction acts along `direction`, a unit vector across the normal, and at a right angle to it.
struct Friction {
    Vector direction;
    double along, across;  // Coulomb coefficients; 0 costs the solver nothing
    double surface_speed;  // at which the first body's surface runs backwards: a wheel's rim [m/s]
    // Normal force that limits friction [N]. ODE's own is the one that holds before any friction acts that is limited
    // so; it misses what other friction presses on.
    double load = kSolved;
    static constexpr double kSolved = -1;
};

// The contacts of one step.
class Contacts {
  public:
    Contacts(const OdeWorld& world, const swe_physics_config& physics);
    ~Contacts();
    Contacts(const Contacts&) = delete;
    Contacts& operator=(const Contacts&) = delete;

    // Forgets all contacts; the next are for a step of this length [s]. Soft ones give a little, no two alike, so that
    // no two of the solver's rows tie.
    void begin(double time_step, bool soft);

    // `gap` < 0 is an overlap; a gap that is open may close within the step, no more. The normal points from `second`
    // (nullptr: the floor or a wall) to `first`. Points, directions and gaps in the world [m].
    dJointID add(dBodyID first, dBodyID second, const Vector& point, const Vector& normal, double gap,
                 const Friction& friction);

    // Friction with the floor at a point of a level body, whose load is known.
    dJointID add_level(dBodyID body, double x, double y, const Friction& friction);

    // Friction at the middle of a level body: against motion along a direction [N], against turning [N m]. Cheaper than
    // add_level(), and cheaper still with dInfinity as the limit.
    dJointID add_brake(dBodyID body, const Vector& direction, double limit);
    dJointID add_turning_brake(dBodyID body, double limit);

    double deepest_overlap() const { return deepest_overlap_; }  // since the world began [m]

  private:
    dJointID create(dBodyID first, dBodyID second, dContact& contact);
    void soften(dContact& contact) const;
    double softness() const;

    const swe_physics_config& physics_;
    const OdeWorld& world_;
    dJointGroupID group_;
    double time_step_ = 0;
    bool soft_ = false;
    unsigned count_ = 0;
    double deepest_overlap_ = 0;
};

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
// ODE made safe: errors that throw, worlds that own their threading, contacts from closed formulas.
// Only the files in world/ know ODE.
#pragma once

#include <ode/ode.h>

#include <cmath>

#include "epuck.hpp"
#include "scene/scene.hpp"
#include "world/constants.hpp"

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

// Where a body stands in the plane, and the direction of its own x axis: cosine and sine of its heading.
struct Place {
    double x, y, cosine, sine;

    Vector forward() const { return {cosine, sine, 0}; }
    // A vector of the body, in the world's directions.
    Vector turned(double along, double across) const {
        return {cosine * along - sine * across, sine * along + cosine * across, 0};
    }
};

// The state of one body.
struct BodyState {
    double position[3], quaternion[4], velocity[3], spin[3];
};

Place place_of(dBodyID body);
BodyState state_of(dBodyID body);
void set_state(dBodyID body, const BodyState& state);
Pose pose_of(dBodyID body);

// A body at rest, pitched about its own y axis (nose down is positive) and then turned by its heading [rad].
dBodyID create_body(dWorldID world, const Vector& position, double heading, double pitch, const dMass& mass);

// A body at rest that stays level: its supports carry it without being solved for. Neither gravity nor any torque tilts
// it.
dBodyID create_level_body(dWorldID world, const Vector& position, double heading, double mass, double vertical_inertia);

Vector turned(const Vector& direction, double angle);  // about the vertical
Vector axis(dBodyID body, int column);               // a column of its rotation matrix: its own x, y or z in the world
Vector to_world(dBodyID body, const Vector& local);  // a point of the body

// How two surfaces rub. Friction acts along `direction`, a unit vector across the normal, and at a right angle to it.
struct Friction {
    Vector direction;
    double along, across;  // Coulomb coefficients; 0 costs the solver nothing
    double surface_speed;  // at which the first body's surface runs backwards: a wheel's rim [m/s]
    double surface_speed_across = 0;
    // Normal force that limits friction [N]. ODE's own is the one that holds before any friction acts that is limited
    // so; it misses what other friction presses on.
    double load = kSolved;
    static constexpr double kSolved = -1;
    double slip_along = 0, slip_across = 0;  // speed that a force makes of its own, as a damper's [m/(s N)]
};

// Spring and damper of a bumper between two bodies.
struct Spring {
    double stiffness = 0, damping = 0;  // [N/m], [N s/m]

    // The force at the end of a step of this length [s] is whole() * (closing speed there + push_out()), if that
    // presses. `gap` and `closing` [m/s] are of its start. The spring is pressed by the mean of the two speeds; the
    // damper works from the moment on at which the gap is closed.
    double whole(double time_step) const { return time_step / 2 * stiffness + damping; }
    double push_out(double gap, double closing, double time_step) const {
        if (stiffness <= 0) return -gap / time_step;
        const double delay = std::fmax(gap, 0) / time_step;
        return stiffness * (time_step / 2 * (closing - delay) - std::fmin(gap, 0)) / whole(time_step) - delay;
    }
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

    // The same, where a bumper gives way: stable at any step.
    dJointID add_sprung(dBodyID first, dBodyID second, const Vector& point, const Vector& normal, double gap,
                        double closing, const Friction& friction, const Spring& spring);

    // Friction with the floor at a point of a level body, whose load is known.
    void add_level(dBodyID body, double x, double y, const Friction& friction);

    // What add() does: the force is rigidity() * (closing speed + push_out()) where that presses.
    double rigidity() const { return 1 / physics_.contact_cfm; }
    double push_out(double gap) const;

    // Takes down an overlap of what does not give way [m].
    void note_overlap(double depth) { deepest_overlap_ = std::fmax(deepest_overlap_, depth); }

    double deepest_overlap() const { return deepest_overlap_; }  // since the world began [m]

  private:
    dJointID create(dBodyID first, dBodyID second, const Vector& point, const Vector& normal, double push_out,
                    dContact& contact);
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

// SPDX-License-Identifier: BSD-3-Clause
// Contacts from closed formulas, as ODE solves for them, and the springs of bumpers.
#pragma once

#include <cmath>

#include "world/constants.hpp"
#include "world/ode.hpp"

namespace swarmevo {

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

    // Records an overlap of what is rigid [m].
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

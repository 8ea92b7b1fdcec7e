// SPDX-License-Identifier: BSD-3-Clause
// ODE made safe: errors that throw, worlds that own their threading; its bodies.
// Only the files in world/ know ODE.
#pragma once

#include <ode/ode.h>

#include "epuck.hpp"
#include "scene/scene.hpp"

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

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
#include "world/ode.hpp"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <mutex>
#include <string>

#include "error.hpp"
#include "world/world.hpp"

namespace swarmevo {
namespace {

// Moment of inertia about horizontal axes of a body that stays level [kg m^2]: a newton at the end of a metre tilts it
// by less than a thousandth of a degree in an hour.
constexpr double kNeverTilts = 1e12;

thread_local unsigned warnings_of_thread = 0;

void on_warning(int, const char*, va_list) {
    ++warnings_of_thread;
}

// ODE ends the process when these return, so they throw: the exception passes through ODE's frames to our step.
[[noreturn]] void on_failure(int number, const char* format, va_list arguments) {
    char text[256];
    std::vsnprintf(text, sizeof text, format, arguments);
    throw Error(SWE_PHYSICS_ERROR, "ODE failed (" + std::to_string(number) + "): " + text);
}

void initialise_ode() {
    static std::once_flag once;
    std::call_once(once, [] {
        dInitODE2(0);
        dSetMessageHandler(on_warning);
        dSetErrorHandler(on_failure);
        dSetDebugHandler(on_failure);
    });
    thread_local const bool prepared = dAllocateODEDataForThread(dAllocateMaskAll) != 0;
    if (!prepared) throw Error(SWE_OUT_OF_MEMORY, "ODE could not allocate its data for a thread");
}

}  // namespace

OdeWorld::OdeWorld() {
    initialise_ode();
    id_ = dWorldCreate();
    threading_ = dThreadingAllocateSelfThreadedImplementation();
    dWorldSetStepThreadingImplementation(id_, dThreadingImplementationGetFunctions(threading_), threading_);
}

OdeWorld::~OdeWorld() {
    if (broken_) return;  // its lists may be half changed: leaking them is safe, walking them is not
    dWorldDestroy(id_);
    dThreadingFreeImplementation(threading_);
}

unsigned OdeWorld::step(double time_step) {
    warnings_of_thread = 0;
    broken_ = true;  // until the step is over
    if (!dWorldStep(id_, time_step)) throw Error(SWE_OUT_OF_MEMORY, "ODE could not allocate memory for a step");
    broken_ = false;
    return warnings_of_thread;
}

Place place_of(dBodyID body) {
    const dReal *p = dBodyGetPosition(body), *r = dBodyGetRotation(body);
    return {p[0], p[1], r[0], r[4]};
}

BodyState state_of(dBodyID body) {
    BodyState state;
    std::copy_n(dBodyGetPosition(body), 3, state.position);
    std::copy_n(dBodyGetQuaternion(body), 4, state.quaternion);
    std::copy_n(dBodyGetLinearVel(body), 3, state.velocity);
    std::copy_n(dBodyGetAngularVel(body), 3, state.spin);
    return state;
}

void set_state(dBodyID body, const BodyState& s) {
    dBodySetPosition(body, s.position[0], s.position[1], s.position[2]);
    dBodySetQuaternion(body, s.quaternion);
    dBodySetLinearVel(body, s.velocity[0], s.velocity[1], s.velocity[2]);
    dBodySetAngularVel(body, s.spin[0], s.spin[1], s.spin[2]);
}

// ODE's rotation matrices are 3 x 4, row-major.
Pose pose_of(dBodyID body) {
    const dReal *p = dBodyGetPosition(body), *r = dBodyGetRotation(body);
    return {p[0], p[1], std::atan2(r[4], r[0])};
}

dBodyID create_body(dWorldID world, const Vector& position, double heading, double pitch, const dMass& mass) {
    dBodyID body = dBodyCreate(world);
    dBodySetMass(body, &mass);
    dBodySetPosition(body, position[0], position[1], position[2]);
    dQuaternion turn, nod, both;
    dQFromAxisAndAngle(turn, 0, 0, 1, heading);
    dQFromAxisAndAngle(nod, 0, 1, 0, pitch);
    dQMultiply0(both, turn, nod);
    dBodySetQuaternion(body, both);
    return body;
}

dBodyID create_level_body(dWorldID world, const Vector& position, double heading, double mass,
                          double vertical_inertia) {
    dMass level;
    dMassSetParameters(&level, mass, 0, 0, 0, kNeverTilts, kNeverTilts, vertical_inertia, 0, 0, 0);
    const dBodyID body = create_body(world, position, heading, 0, level);
    dBodySetGravityMode(body, 0);
    dBodySetGyroscopicMode(body, 0);
    return body;
}

Vector turned(const Vector& direction, double angle) {
    const double c = std::cos(angle), s = std::sin(angle);
    return {c * direction[0] - s * direction[1], s * direction[0] + c * direction[1], 0};
}

Vector axis(dBodyID body, int column) {
    const dReal* r = dBodyGetRotation(body);
    return {r[column], r[4 + column], r[8 + column]};
}

Vector to_world(dBodyID body, const Vector& local) {
    const dReal *r = dBodyGetRotation(body), *p = dBodyGetPosition(body);
    Vector world;
    for (int i = 0; i < 3; ++i)
        world[i] = p[i] + r[4 * i] * local[0] + r[4 * i + 1] * local[1] + r[4 * i + 2] * local[2];
    return world;
}

void provoke_ode_assertion() {
    initialise_ode();
    dWorldStep(nullptr, 1);  // ODE asserts that there is a world
}

const char* ode_description() {
    return dCheckConfiguration("ODE_double_precision") ? "ODE " dODE_VERSION ", double precision"
                                                       : "ODE " dODE_VERSION ", single precision";
}

}  // namespace swarmevo

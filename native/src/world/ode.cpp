// SPDX-License-Identifier: BSD-3-Clause
#include "world/ode.hpp"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <mutex>
#include <string>

#include "error.hpp"
#include "world/constants.hpp"
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

// A contact of which only the friction is known.
dContact rubbing(const Friction& friction) {
    const bool is_known = friction.load != Friction::kSolved;
    const double unit = is_known ? friction.load : 1;
    dContact contact{};
    contact.surface.mode = dContactMu2 | dContactFDir1 | dContactMotionN | dContactMotion1 | dContactMotion2 |
                           dContactSlip1 | dContactSlip2;
    if (!is_known) contact.surface.mode |= dContactApprox1_1 | dContactApprox1_2;
    contact.surface.mu = friction.along * unit;
    contact.surface.mu2 = friction.across * unit;
    contact.surface.motion1 = friction.surface_speed;
    contact.surface.motion2 = friction.surface_speed_across;
    contact.surface.slip1 = friction.slip_along;
    contact.surface.slip2 = friction.slip_across;
    std::copy_n(friction.direction.begin(), 3, contact.fdir1);
    return contact;
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

Contacts::Contacts(const OdeWorld& world, const swe_physics_config& physics)
    : physics_(physics), world_(world), group_(dJointGroupCreate(0)) {}

Contacts::~Contacts() {
    if (!world_.is_broken()) dJointGroupDestroy(group_);
}

void Contacts::begin(double time_step, bool soft) {
    time_step_ = time_step;
    soft_ = soft;
    count_ = 0;
    dJointGroupEmpty(group_);
}

dJointID Contacts::add(dBodyID first, dBodyID second, const Vector& point, const Vector& normal, double gap,
                       const Friction& friction) {
    dContact contact = rubbing(friction);
    note_overlap(-gap);
    return create(first, second, point, normal, push_out(gap), contact);
}

double Contacts::push_out(double gap) const {
    const double time = std::max(time_step_, kCorrectionTime);
    const double correction = std::min(kLargestCorrection, physics_.contact_erp * std::max(0.0, -gap) / time);
    return correction - (std::max(0.0, gap) + kTouch) / time_step_;
}

dJointID Contacts::add_sprung(dBodyID first, dBodyID second, const Vector& point, const Vector& normal, double gap,
                              double closing, const Friction& friction, const Spring& spring) {
    dContact contact = rubbing(friction);
    contact.surface.mode |= dContactSoftCFM;
    contact.surface.soft_cfm = 1 / spring.whole(time_step_);
    return create(first, second, point, normal, spring.push_out(gap, closing, time_step_), contact);
}

void Contacts::add_level(dBodyID body, double x, double y, const Friction& friction) {
    dContact contact = rubbing(friction);
    contact.surface.mu *= 1 + count_ * kTieBreak;
    contact.surface.motionN = -1;  // the normal, which ODE's contacts always have, never presses
    const dReal point[3] = {x, y, dBodyGetPosition(body)[2]};
    std::copy_n(point, 3, contact.geom.pos);
    contact.geom.normal[2] = 1;
    create(body, nullptr, contact);
}

double Contacts::softness() const {
    return physics_.contact_cfm * (2 + count_ % 13 / 13.0);
}

dJointID Contacts::create(dBodyID first, dBodyID second, const Vector& point, const Vector& normal, double push_out,
                          dContact& contact) {
    contact.surface.motionN = push_out;
    std::copy_n(point.begin(), 3, contact.geom.pos);
    std::copy_n(normal.begin(), 3, contact.geom.normal);
    return create(first, second, contact);
}

dJointID Contacts::create(dBodyID first, dBodyID second, dContact& contact) {
    if (soft_) soften(contact);
    ++count_;
    const dJointID joint = dJointCreateContact(world_.id(), group_, &contact);
    dJointAttach(joint, first, second);
    return joint;
}

void Contacts::soften(dContact& contact) const {
    contact.surface.mode |= dContactSoftCFM;
    for (dReal* softness_of : {&contact.surface.soft_cfm, &contact.surface.slip1, &contact.surface.slip2})
        *softness_of = std::max(*softness_of, softness());
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

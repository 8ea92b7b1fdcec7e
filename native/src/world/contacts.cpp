// SPDX-License-Identifier: BSD-3-Clause
#include "world/contacts.hpp"

#include <algorithm>
#include <cmath>

namespace swarmevo {
namespace {

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

}  // namespace

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

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
// Coulomb friction of one point with the floor, in a circle.
//
//   force = -limit slip / |slip|    while it slips; any force up to the limit while it sticks
//
// What sticks does so by springs that remember: the force is that of the last step, changed by kStickSlip of slip for
// the whole limit, and cut to the limit. So a point that stands does not creep under a steady force.
//
// Rows of ODE's contact problem limit friction along and across a direction separately, which is a pyramid: in its
// corners a wheel would pull 1.4 times as hard, and a box that slides would keep all of its friction across its way, as
// on rails. So there the law is linearised about a guess of the slip at the end of the step (Newton's method): along
// the guess u up to the whole limit, across it a damper whose force is none where the guess was right,
//
//   force = -limit u - limit / |guess| (slip across u),    u = guess / |guess|
//
// After the step the slip that came out is compared, and is the next guess where the two differ.
#pragma once

#include "world/constants.hpp"
#include "world/contacts.hpp"

namespace swarmevo {

class Rub {
  public:
    // Before a step: the largest friction [N], the axis of the body in whose frame the last force is remembered, and
    // the slip as the body moves now [m/s].
    void expect(double limit, const Vector& axis, const Vector& slip);

    // The largest friction, as loads turn out [N].
    void set_limit(double limit) { limit_ = limit; }
    double limit() const { return limit_; }

    // ---- for a solver of our own (compliant.hpp) ----

    // Friction at a slip [N], and how it falls with it: -d force / d slip, a symmetric matrix [N s/m].
    struct Law {
        double fx, fy;
        double dxx, dxy, dyy;
    };
    Law law(double slip_x, double slip_y) const;

    // ---- for ODE ----

    // Lays out its rows at a point of a level body. `surface`: velocity at which the body's own surface rolls there, as
    // a wheel's does [m/s].
    void add(Contacts& contacts, dBodyID body, double x, double y, const Vector& surface);

    // The same where the floor's normal force is solved for too: `gap` as in Contacts::add.
    void add_pressed(Contacts& contacts, dBodyID body, const Vector& point, double gap);

    // After the step, with the slip that came out [m/s]: was the friction what Coulomb says? If not, this is the next
    // guess. `limit`: as the loads turned out.
    bool fits(const Vector& slip, double limit);

    double load() const { return rows_.f1[2]; }  // of the floor, where it was solved for [N]

    // ---- after a step ----

    // That came out with this force [N].
    void remember(double fx, double fy);

    // Did it stick in the last step?
    bool sticks() const { return along_ * along_ + across_ * across_ < kSticking * limit_ * limit_; }

    // What ODE's rows did at a slip [N].
    Vector force(const Vector& slip) const;

  private:
    void guess(const Vector& slip);
    double drag() const;
    Friction rows(const Vector& surface) const;

    double limit_ = 0;
    Vector axis_{1, 0, 0};
    double along_ = 0, across_ = 0;   // last force in the axis' frame [N]
    double last_x_ = 0, last_y_ = 0;  // and in the world's
    Vector direction_{1, 0, 0};       // of the guess
    double speed_ = 0;                // [m/s]
    dJointFeedback rows_{};
};

}  // namespace swarmevo

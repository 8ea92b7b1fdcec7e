// SPDX-License-Identifier: BSD-3-Clause
// Moves bodies by the mean velocity of a step, and lays contacts out where the step ends.
//
// ODE advances positions with the velocity at the end of a step, from geometry at its start (symplectic Euler). Here a
// body goes from its start by (v + w) h / 2, with its velocities v before and w after a step of length h, which is
// right to second order; and w follows from contacts as they will be when it holds: bodies are placed as if they went
// on with v. Normals and rolling directions of the start would bend every curve outwards.
//
// A body that only the floor touches changes its velocity by Coulomb friction at its limit a: in |w - v| / a, at most
// h, and so moves on with w for the rest of the step.
#pragma once

#include <vector>

#include "world/ode.hpp"

namespace swarmevo {

class AverageVelocity {
  public:
    // Largest accelerations by friction with the floor alone.
    struct Limits {
        double linear;   // [m/s^2]
        double angular;  // about the vertical [rad/s^2]
        double reach;    // from its middle to the farthest of its sides [m]
    };

    // Sides that may meet in the coming step, as in Contacts::add.
    struct Touch {
        int first, second;  // numbers of bodies; kWall
        double x, y;        // where [m]
        double normal_x, normal_y;
        double gap;      // between rims as bodies are placed; after note() at the start of the step [m]
        double travel;   // of the bumpers between them [m]
        double recoil;   // acceleration of a robot by each metre that they are pressed in [1/s^2]
        double closing;  // speed at which the gap closes at the start of the step; after note() [m/s]
    };
    static constexpr int kWall = -1;

    // `drifts`: false for a model that runs at steps that need none of this.
    explicit AverageVelocity(bool drifts) : drifts_(drifts) {}

    // Bodies are numbered in the order in which they are added. Returns the body's number.
    int add_body(dBodyID body, const Limits& limits);

    // Before a step of this length [s]: records all velocities, and where they lead to. `cautious`: whatever is
    // noted is likely to meet.
    void begin(double time_step, bool cautious);

    // Where a body will stand at the end of the step if it goes on as it does: contacts are laid out there.
    const Place& place(int body) const { return bodies_[body].end; }

    // Takes a body there, for ODE.
    void place_body(int body) const;

    // The velocity on the floor that a body's drive is about to give it [m/s]; its present one if it has no drive.
    void intend(int body, double x, double y);

    // The body stays as it is in the step, whatever its drive does.
    void hold(int body) { bodies_[body].intended = bodies_[body].before; }

    // Are the sides likely to meet in the step? Not where others would have to push them.
    bool note(Touch& touch);

    // Could a gap between the sides that were noted last be closed in the step, as `note` understands it?
    bool may_close(double gap) const;

    const std::vector<Touch>& touches() const { return touches_; }  // that are likely

    // After the step is solved for: records the velocities that came out.
    void read_velocities();

    // And then: did all keep apart that were not likely to meet?
    bool kept_clear() const;

    // Share of the step after which bumpers met that were apart and are pressed in by more than a little in the end, of
    // those that met first. 1 where none did.
    double until_impact() const;

    // How far a body that touched another may have moved too far in the step, or too little [m].
    double error() const;

    // And then: moves the bodies.
    void apply();

    // When all is moved: finds who has settled.
    void settle();

    // Did the body neither move nor change its speed in the last step?
    bool has_settled(int body) const { return bodies_[body].settled; }

  private:
    struct Motion {
        double x, y, spin;  // [m/s], [rad/s]
    };
    struct Body {
        dBodyID id;
        Limits limits;
        Vector start;  // [m]
        dQuaternion start_turn;
        Place end;                     // of the step, by the velocity before it
        Motion before, intended, now;  // now: after the step
        Motion missing;                // way [m] and turn [rad] to add
        bool in_touch;                 // with anything
        bool settled;                  // since the last step
    };

    static Motion motion_of(dBodyID body);
    double approach(const Touch& touch, Motion Body::*when) const;
    Motion missing_way(const Body& body) const;
    void keep_apart(const Touch& touch);
    static void move(const Body& body, const Motion& way);

    const bool drifts_;
    double time_step_ = 0;
    bool cautious_ = false;
    double speed_ = 0;  // at which the sides that were noted last near each other [m/s]
    std::vector<Body> bodies_;
    std::vector<Touch> touches_;
    std::vector<Touch> to_check_;  // that are not likely
};

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
// Moves bodies by the mean velocity of a step instead of its last one.
//
// ODE advances positions with the velocity at the end of a step (symplectic Euler). A body whose velocity changed from
// v to w at the time t in the step should have moved by v t + w (step - t); so (v - w) t is missing. Left alone, these
// millimetres at each start and stop are most of the error of a coarse step. The time t is known:
//
//   - A body that only the floor touches is accelerated by Coulomb friction at its limit a, until it has the velocity
//     it wants: for |w - v| / a, at most the step. On average t is half of that.
//   - Bodies that touch each other or walls accelerate together under steady forces: t is half the step. All that are
//     in contact are moved alike, so no gap opens or closes.
//   - Where a gap closes within a step, velocities jump: the world cuts its steps there (first_collision). Bodies that
//     collide all the same, and all that they touch, keep ODE's positions.
#pragma once

#include <vector>

#include "world_ode.hpp"

namespace swarmevo {

class AverageVelocity {
  public:
    // Largest accelerations by friction with the floor alone.
    struct Limits {
        double linear;   // [m/s^2]
        double angular;  // about the vertical [rad/s^2]
    };

    // A possible contact between sides in the coming step, as in Contacts::add.
    struct Touch {
        int first, second;  // numbers of bodies; kWall
        double x, y;        // where [m]
        double normal_x, normal_y;
        double gap;  // [m]
    };
    static constexpr int kWall = -1;

    // Bodies are numbered in the order in which they are added.
    void add_body(dBodyID body, const Limits& limits);

    // Before a step of this length [s]: takes down all velocities. `cautious`: whatever is noted is likely to meet.
    void begin(double time_step, bool cautious);

    // The velocity on the floor that a body's drive is about to give it [m/s]; its present one if it has no drive.
    void intend(int body, double x, double y);

    // Will the bodies meet in the step? They are far from it where others would have to shove them as wheels cannot,
    // and unlikely to where others would have to shove them at all.
    enum class Meeting { far, unlikely, likely };
    Meeting note(const Touch& touch);

    const std::vector<Touch>& touches() const { return touches_; }  // noted since begin(), and not far

    // When in the step bodies first collide [s]; infinity if none do.
    double first_collision() const;

    // After it: did all keep apart that were not likely to meet?
    bool kept_clear();

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
        Motion before, intended, now;  // now: after the step
        Motion missing;                // way [m] and turn [rad] to add
        int group;                     // number of another body of its group, or its own
        bool in_touch;                 // with anything
        bool settled;                  // since the last step
        bool collides;                 // anybody of the group; true at its root
    };

    static Motion motion_of(dBodyID body);
    double approach(const Touch& touch, Motion Body::*when) const;
    double collision_time(const Touch& touch) const;
    int root(int body) const;
    void join(const Touch& touch);
    Motion missing_way(const Body& body) const;
    bool keep_apart();
    static void move(const Body& body);

    double time_step_ = 0;
    bool cautious_ = false;
    std::vector<Body> bodies_;
    std::vector<Touch> touches_;
    std::vector<Touch> to_check_;  // that are not likely
};

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
// The box and its friction with the floor.
//
// Solved for, this friction is two rows of the contact problem at each of four corners, and the box joins all robots
// that touch it into one problem. A level box mostly goes on as it did, so that is assumed, and checked after the step:
//
//   - One that stands is a wall to all that touch it, while floor and walls can hold it against them.
//   - One that slides gets the friction against its motion as a force, while no corner turns back; across its motion it
//     sticks to the floor, while the corners' friction can hold it.
//
// Where that comes true it is the solution of the whole problem; else the step is taken back and solved in full.
#pragma once

#include <array>

#include "world_ode.hpp"

namespace swarmevo {

class Box {
  public:
    // At its pose and speed of the scene's beginning.
    Box(const Scene& scene, dWorldID world);

    dBodyID body() const { return body_; }
    double reach() const { return reach_; }         // from its middle to its corners [m]
    double height() const { return half_height_; }  // of its centre [m]

    // Before a step is laid out, maybe not for the first time. `is_still`: neither moved nor changed its speed in the
    // last one.
    void assume(bool is_still);

    // In the step that is laid out it is a wall.
    bool stands() const { return assumed_ == Assumed::stands; }

    // Of a step in which it may move.
    void add_floor_contacts(Contacts& contacts);

    // What others do to it, in the plane.
    struct Load {
        double x, y;    // force [N]
        double torque;  // about its middle [N m]
    };

    // Did it do what was assumed under this load? If not, the step is to be taken back; nothing is assumed until
    // finish().
    bool moved_as_assumed(const Load& load);

    // After a step that holds.
    void finish();

    // Of a corner from the middle, in the world's directions; [0, kCorners) [m].
    Vector corner(int number) const;
    static constexpr int kCorners = 4;

  private:
    enum class Assumed { nothing, stands, slides };

    Vector foot(int number) const;
    void add_foot(Contacts& contacts, int number) const;
    double slowest_corner() const;
    bool floor_holds(Load load) const;
    bool floor_holds_across() const;
    void take_by_walls(Load& load) const;

    const Scene& scene_;
    dBodyID body_;
    double reach_, half_height_;
    double corner_limit_;  // of friction at a corner [N]
    bool is_level_;
    Assumed assumed_ = Assumed::nothing;
    bool doubts_ = false;  // an assumption of this step was wrong
    Vector direction_{};   // of its motion
    // What brakes did that hold a sliding box across its motion, and from turning.
    dJointFeedback across_{}, turning_{};
};

}  // namespace swarmevo

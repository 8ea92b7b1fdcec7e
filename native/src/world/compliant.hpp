// SPDX-License-Identifier: BSD-3-Clause
// The velocities after a step of level bodies that touch: by Newton's method.
//
// Need: the velocities v at the end of a step of length h, in the plane, of bodies that touch,
//
//   M g (v - u) / h = sum of forces at v
//
// From rest, and after an impact or a jump of rim speeds, the step is Euler's implicit one: g = 1, and u is the
// velocity v0 before. Where a body has moved smoothly since the step before, of length h / r from the velocity v1, it
// is of second order (backward differentiation, BDF2), as stable, and no dearer:
//
//   g = (1 + 2 r) / (1 + r)    u = ((1 + r) v0 - r^2 / (1 + r) v1) / g
//
// Each force is minus the gradient of a convex function of v, as long as friction's limits are given: what presses, as
// max(0, damping v + spring), of bumpers and, a thousand times stiffer, of what is rigid; and friction, cut to its
// limit. So there is one solution, and Newton's method with a line search finds it; the limits, which follow from
// loads, are brought up to date in between. It takes 2 to 6 rounds from the velocities before, each the solution
// of a linear system: a small part of the time of ODE's solver for the same contacts, which has to try each contact as
// pressing or parting and each friction as sticking or slipping, and has friction in a rectangle, not in a circle.
//
// ODE takes the step where the rounds do not come to an end, and all steps of the articulated drive. Both are held
// against each other in native/tests/world/test_compliant.cpp.
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "world/drive.hpp"
#include "world/rub.hpp"
#include "world/sides.hpp"

namespace swarmevo {

class CompliantStep {
  public:
    // `contacts`: rigid bodies and stops are as rigid as there. `force_error`: at which a body's forces are in balance
    // [N].
    CompliantStep(Contacts& contacts, double force_error) : contacts_(contacts), force_error_(force_error) {}

    void begin(double time_step);

    // Bodies that are solved for, where contacts find them. `drive`: of a robot, nullptr of the box.
    void add_body(int number, dBodyID body, const Place& place, Drive* drive);

    // Friction with the floor of the body that was added last, at a point from its middle, in the world's directions
    // [m].
    void add_rub(Rub& rub, const Vector& arm, const Vector& surface);

    // Bodies that were not added are fixed.
    void add_pair(Sides::Pair& pair);

    // Gives the bodies their velocities, and rubs and pairs their forces. False, and nothing is changed, where the
    // iteration does not come to an end.
    bool solve();

    // After a step that holds and was solved for here: the next one goes on from it. Before sides finish it.
    void remember();

    // The next step does not go on from the last one: for no body, or not for this one.
    void forget();
    void forget(int number);

  private:
    struct Body {
        dBodyID id;
        int number;
        Drive* drive;
        double mass, inertia, x, y;
        double gain;       // g above
        double from[3];    // u above
        double before[3];  // velocity: x, y [m/s], about the vertical [rad/s]
        double guess[3];   // of the velocity after the step
        double after[3];   // it
        int group;         // of bodies that touch: number of another, or its own
        int row;           // in the group's system
    };
    struct Foot {
        Rub* rub;
        int body;
        double arm_x, arm_y, surface_x, surface_y;
        double slip_x = 0, slip_y = 0;
        Rub::Law law{};
    };
    // A side of a touch. Of its body's velocity, the part along these is the speed at which the side parts from and
    // slides along the other.
    struct End {
        int body;  // -1: fixed
        Eigen::Vector3d normal, tangent;
    };
    struct Touch {
        Sides::Pair* pair;
        End ends[2];
        // Forces of bumper and stop: stiffness (closing + push_out) where that presses.
        double stiffness, push_out, stop_push_out;
        double closing = 0, sliding = 0;  // [m/s]
        double press = 0, drag = 0;       // forces [N]
        double rate = 0;                  // at which they grow with closing [N s/m]
        bool sticks = false;
        bool stops = false;  // the stop presses
    };
    // The last step of a body.
    struct Past {
        double before[3];      // velocity: x, y [m/s], about the vertical [rad/s]
        double time_step = 0;  // [s]; 0: the next one does not go on from it
    };

    void use_second_order(Body& body) const;
    static void use_euler(Body& body);
    int root(int body) const;
    bool solve_group(int group);
    void evaluate(double share);
    void assemble();
    Eigen::Matrix3d& block(int row, int column);
    bool is_coupled(std::size_t row, std::size_t column) const { return coupled_[row * group_bodies_.size() + column]; }
    void find_way();
    void find_kinks();
    double line_search();
    bool update_loads();
    bool is_balanced() const;

    Contacts& contacts_;
    double force_error_, time_step_ = 0;
    std::vector<Body> bodies_;
    std::vector<int> index_;  // of a body's number in `bodies_`, or -1
    std::vector<Past> past_;  // by number
    std::vector<Foot> feet_;
    std::vector<Touch> touches_;
    // Of the group that is solved.
    std::vector<Body*> group_bodies_;
    std::vector<Foot*> group_feet_;
    std::vector<Touch*> group_touches_;
    std::vector<double> kinks_;
    Eigen::VectorXd velocity_, residual_, way_, trial_;
    // The derivative of the residual: a block for each two bodies, where they touch.
    std::vector<Eigen::Matrix3d> blocks_;
    std::vector<char> coupled_;
};

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
// Where the sides of robots, box and walls meet: discs, a rectangle and lines in the plane, in closed form.
//
// A robot's bumper goes all round its body; its rim is the body's radius. It gives way inwards until it has used up its
// travel: there a rigid stop is. Two robots' bumpers act one behind the other.
#pragma once

#include <cmath>

#include "world/average.hpp"
#include "world/box.hpp"
#include "world/contacts.hpp"

namespace swarmevo {

// Finds what may meet in a step that `average` has begun.
class Sides {
  public:
    Sides(const Scene& scene, AverageVelocity& average);

    struct Solid {
        dBodyID body;  // nullptr: fixed
        int number;    // in `average`
        int bumpers;   // 1 for a robot, 0 for box and wall
    };

    // Two sides that may meet, and what they did when they were last solved for.
    struct Pair {
        bool may_meet = false;     // in this step
        bool may_stop = false;     // there are no bumpers, or they may be used up within the step
        int first, second;         // numbers in `average`; kFixed
        dBodyID bodies[2];         // nullptr: fixed
        Vector point{}, normal{};  // where; from the second to the first
        double gap, travel;        // between rims at the start of the step; of the bumpers [m]
        double closing;            // speed at which the gap closes there [m/s]
        Spring spring;             // of the bumpers
        double side_friction;
        double load = Friction::kSolved;  // normal force that limited friction in the last step [N]
        double rubbing = 0;               // friction in the last step, along the normal turned by a quarter [N]
        Vector force{};                   // on the first [N]
        dJointFeedback bumper{}, stop{};

        double press() const { return std::fmax(0, force[0] * normal[0] + force[1] * normal[1]); }
    };
    static constexpr int kFixed = -1;

    // Before the contacts of a step are added.
    void begin();

    // Each returns whether anything is likely to meet in the step.
    bool add_robot_at_walls(const Solid& robot);
    bool add_robots(const Solid& first, const Solid& second);
    bool add_push(const Solid& robot, const Box& box, int box_number);
    void add_box_at_walls(const Box& box, int box_number);

    // Those that may meet in the step.
    const std::vector<Pair*>& pairs() const { return meeting_; }

    // ---- for ODE ----

    void add_to(Contacts& contacts);

    // After the step: records the forces that came out.
    void read_forces();

    // And then: is friction limited by the normal forces that it came out with? If not, the step is to be laid
    // out anew, with these. ODE itself limits friction by the forces that hold without any.
    bool fits();

    // After a step that holds.
    void finish();

    // What a robot does to the box.
    const Pair& push(int robot) const { return pairs_[at_box_ + robot]; }

    // What pressed bumpers hold, of robots and a box that stand there [J].
    double stored_energy(const std::vector<Place>& robots, const Place& box) const;

  private:
    struct Side {
        double x, y, height;        // where they meet [m]
        double normal_x, normal_y;  // from the second to the first
        double gap;                 // between rims [m]
    };
    Side side_of_robots(const Place& first, const Place& second) const;
    Side side_of_push(const Place& robot, const Place& box) const;
    bool add(Pair& pair, const Solid& first, const Solid& second, const Side& side);
    // `first`: of its four pairs.
    bool add_walls(Pair* first, const Solid& solid, double x, double y, double radius, double height);

    const Scene& scene_;
    AverageVelocity& average_;
    double reach_;  // gap from which nothing meets within a step [m]
    bool sprung_;
    double slight_load_;  // difference of two loads that does not matter [N]
    // Robots with those before them, then with walls, then with the box; the box's corners with walls.
    std::vector<Pair> pairs_;
    std::vector<Pair*> meeting_;
    int at_walls_, at_box_, corners_;  // where those begin
};

}  // namespace swarmevo

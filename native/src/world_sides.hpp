// SPDX-License-Identifier: BSD-3-Clause
// Where the sides of robots, box and walls meet: discs, a rectangle and lines in the plane, in closed form.
#pragma once

#include "world_average.hpp"
#include "world_box.hpp"
#include "world_ode.hpp"

namespace swarmevo {

// Lays out the contacts of one step: `contacts` and `average` have begun it.
class Sides {
  public:
    using Meeting = AverageVelocity::Meeting;

    Sides(const Scene& scene, Contacts& contacts, AverageVelocity& average);

    struct Solid {
        dBodyID body;  // nullptr: it does not give way
        int number;    // in `average`
    };

    // A disc, or with a radius of 0 a point, and all walls; what meets is this high [m]. The likeliest meeting.
    Meeting add_walls(const Solid& solid, double x, double y, double radius, double height);

    Meeting add_robots(const Solid& first, const Solid& second);

    // What a robot does to the box.
    struct Push {
        bool may_be = false;       // there is a contact in this step
        Vector point{}, normal{};  // on the box; from there to the robot
        dJointFeedback joint{};    // of the robot with the box, when it was last solved for
    };

    // Keeps a pointer to `push`.
    Meeting add_push(const Solid& robot, const Box& box, int box_number, Push& push);

    void add_box_at_walls(const Box& box, int box_number);

  private:
    Meeting add(const Solid& first, const Solid& second, double x, double y, double height, double normal_x,
                double normal_y, double gap, dJointFeedback* feedback = nullptr);

    const Scene& scene_;
    Contacts& contacts_;
    AverageVelocity& average_;
    double reach_;  // gap from which nothing meets within a step [m]
};

}  // namespace swarmevo

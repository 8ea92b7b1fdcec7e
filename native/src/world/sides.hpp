// SPDX-License-Identifier: BSD-3-Clause
// Where the sides of robots, movables, obstacles and walls meet: discs, rectangles and lines in the plane, in closed
// form (rectangles.hpp for two of these).
//
// A robot's bumper goes all round its body; its rim is the body's radius. It gives way inwards until it has used up its
// travel: there a rigid stop is. Two robots' bumpers act one behind the other.
#pragma once

#include <cmath>

#include "world/average.hpp"
#include "world/contacts.hpp"
#include "world/movable.hpp"

namespace swarmevo {

// Where two bodies may meet.
struct Meeting {
    double x, y, height;        // [m]
    double normal_x, normal_y;  // from the second to the first
    double gap;                 // between rims [m]
};

// Finds what may meet in a step that `average` has begun.
class Sides {
  public:
    Sides(const Scene& scene, AverageVelocity& average);

    struct Solid {
        dBodyID body;  // nullptr: fixed
        int number;    // in `average`
        int bumpers;   // 1 for a robot, 0 for all else
    };

    // Two sides that may meet, and what they did when they were last solved for.
    struct Pair {
        bool may_meet = false;     // in this step
        bool may_stop = false;     // there are no bumpers, or they may be used up within the step
        int first, second;         // numbers in `average`; kFixed
        int second_side;           // of the second, though it is fixed
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

    // Each returns whether anything is likely to meet in the step. `movable`: its place in the scene's list.
    bool add_robot_at_walls(const Solid& robot);
    bool add_robot_at_obstacles(const Solid& robot);
    bool add_robots(const Solid& first, const Solid& second);
    bool add_push(const Solid& robot, const Movable& movable, int number);
    void add_movable_at_walls(const Movable& movable, int number);
    void add_movable_at_obstacles(const Movable& movable, int number);
    void add_movables(const Movable& first, int first_number, const Movable& second, int second_number);

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

    // What others do to a body that stands, about its middle.
    Load load_on(int number) const;

    // What a robot does to a movable.
    const Pair& push(int robot, int movable) const { return pairs_[at_movables_ + robot * movables_ + movable]; }

    // What pressed bumpers hold, of robots and movables that stand there [J].
    double stored_energy(const std::vector<Place>& robots, const std::vector<Place>& movables) const;

  private:
    Meeting meeting_of_robots(const Place& first, const Place& second) const;
    // A disc that meets a figure: with its radius, 0 for a corner, and the height up to which both reach.
    static Meeting meeting_of_disc(double x, double y, double radius, double height, const Figure& figure,
                                   const Place& place);
    Meeting meeting_of_push(const Place& robot, const Figure& figure, const Place& place) const;
    Meeting meeting_of_obstacle(const Place& robot, std::size_t obstacle) const;
    static Solid solid_of(const Movable& movable);
    // May something that reaches so far [m] meet a figure in the step? Cheaper than the meeting.
    bool is_near(const Place& place, double reach, const Figure& figure, const Place& other) const;

    bool add(Pair& pair, const Solid& first, const Solid& second, const Meeting& meeting);
    // `first`: of as many pairs as there are walls.
    bool add_walls(Pair* first, const Solid& solid, double x, double y, double radius, double height);
    // `first`: of kMeetings pairs.
    void add_figures(Pair* first, const Movable& movable, const Solid& solid, const Solid& other, const Figure& figure,
                     const Place& place);

    static constexpr int kMeetings = 2;  // of two rectangles: at both ends of what their sides have in common

    const Scene& scene_;
    AverageVelocity& average_;
    double reach_;  // gap from which nothing meets within a step [m]
    bool sprung_;
    double slight_load_;  // difference of two loads that does not matter [N]
    std::vector<Place> obstacles_;
    std::size_t walls_;  // a round one counts as one
    int movables_;
    // Robots with those before them, with walls, with movables, with obstacles; movables with walls, by their corners,
    // with obstacles, with those before them.
    std::vector<Pair> pairs_;
    std::vector<Pair*> meeting_;  // in the step as it is laid out
    std::vector<Pair*> met_;      // in the last one that held, or in a try of this one; some more than once
    std::size_t at_walls_, at_movables_, at_obstacles_, movable_at_walls_, movable_at_obstacles_, movable_at_movables_;
};

}  // namespace swarmevo

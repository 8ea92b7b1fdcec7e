// SPDX-License-Identifier: BSD-3-Clause
// The box and its friction with the floor: Coulomb's circle under each of its four feet, which are its corners.
//
// A box that stands is a wall to all that touch it, as long as floor and walls can hold it against them: exactly as
// long as the limit curve of its feet says so (limit_curve.hpp). That is assumed, and checked after the step; it
// saves the rows of the box, and joins no two robots into one contact problem. Else each foot rubs (rub.hpp).
//
// Simplification where bodies stay level: each foot carries a quarter of the weight. A push above the floor shifts
// about a tenth of that forward; the articulated drive, whose box is free in three dimensions, does so.
#pragma once

#include <array>

#include "world/contacts.hpp"
#include "world/limit_curve.hpp"
#include "world/rub.hpp"

namespace swarmevo {

class CompliantStep;

class Box {
  public:
    // At its pose and speed of the scene's beginning.
    Box(const Scene& scene, dWorldID world);

    dBodyID body() const { return body_; }
    double reach() const { return reach_; }         // from its middle to its corners [m]
    double height() const { return half_height_; }  // of its centre [m]

    // Before a step is laid out for the first time: feet are expected to slip as they do now.
    void expect() { expects_ = true; }

    // And whether it is a wall in this step: if it is still, level, and rubs at all.
    void assume_standing(bool is_still) { stands_ = is_level_ && is_still && corner_limit_ > 0; }
    bool stands() const { return stands_; }

    // Where the contacts of the step that is laid out find it.
    void place_at(const Place& place);

    // Of a step in which it may move.
    void add_to(CompliantStep& step);
    void add_to(Contacts& contacts);

    // After a step in which it stood: can walls and feet hold it against what others do to it? If not, it stands no
    // more, and is expected to begin to slip as the feet give way.
    bool withstands(Load load);

    // After a step of ODE in which it moved: was its friction Coulomb's? If not, the step is to be laid out anew, with
    // what this one showed.
    bool fits();

    // After a step that holds.
    void finish(bool by_ode);

    // Of a corner from the middle, in the world's directions; [0, kCorners) [m].
    const Vector& corner(int number) const { return feet_[number]; }
    static constexpr int kCorners = 4;

  private:
    Vector foot(int number) const;
    Vector slip(int number, const Twist& motion) const;
    Twist motion() const;
    void expect_slips(const Twist& motion);
    void take_by_walls(Load& load) const;

    const Scene& scene_;
    dBodyID body_;
    double reach_, half_height_;
    double corner_limit_;  // of friction at a corner [N]
    bool is_level_;
    bool stands_ = false, expects_ = false;
    std::array<Rub, kCorners> rubs_;
    Place place_{};
    Feet feet_{};                         // from the middle [m]
    std::array<double, kCorners> loads_;  // on them in the last step [N]
};

}  // namespace swarmevo

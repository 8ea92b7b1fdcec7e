// SPDX-License-Identifier: BSD-3-Clause
// What robots push, a box or a cylinder, and its friction with the floor: Coulomb's circle under each of its four feet,
// which are as a rule a box's corners, and lie on a cylinder's rim.
//
// One that stands is a wall to all that touch it, as long as floor and walls can hold it against them: exactly as
// long as the limit curve of its feet says so (limit_curve.hpp). That is assumed, and checked after the step; it
// saves its rows, and joins no two robots into one contact problem. Else each foot rubs (rub.hpp).
//
// Simplification where bodies stay level: each foot carries a quarter of the weight. A push above the floor shifts
// about a tenth of that forward; the articulated drive, with which it is free in three dimensions, does so.
#pragma once

#include <array>

#include "world/average.hpp"
#include "world/contacts.hpp"
#include "world/limit_curve.hpp"
#include "world/rub.hpp"

namespace swarmevo {

class CompliantStep;

class Movable {
  public:
    // At the speed of the scene's beginning.
    Movable(const Scene& scene, const MovableKind& kind, dWorldID world, const Pose& start);

    dBodyID body() const { return body_; }
    const Figure& figure() const { return kind_.figure; }
    double height() const { return half_height_; }  // of its centre [m]
    int number() const { return number_; }          // in `average`
    void set_number(int number) { number_ = number; }

    // Before a step is laid out for the first time: feet are expected to slip as they do now.
    void expect() { expects_ = true; }

    // And whether it is a wall in this step: if it is still, level, and rubs at all.
    void assume_standing(bool is_still) { stands_ = is_level_ && is_still && foot_limit_ > 0; }
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

    // Of a box's corner from the middle, in the world's directions; [0, kCorners) [m].
    const Vector& corner(int number) const { return corners_[number]; }
    static constexpr int kCorners = 4;

    // Largest accelerations by its friction with the floor.
    AverageVelocity::Limits limits() const;

  private:
    static constexpr int kFeet = 4;

    Vector foot(int number) const;
    Vector slip(int number, const Twist& motion) const;
    Twist motion() const;
    void expect_slips(const Twist& motion);
    void take_by_walls(Load& load) const;

    const Scene& scene_;
    const MovableKind& kind_;
    dBodyID body_;
    int number_ = 0;
    double half_height_;
    double foot_limit_;  // of friction at a foot [N]
    bool is_level_;
    bool stands_ = false, expects_ = false;
    std::array<Rub, kFeet> rubs_;
    Place place_{};
    Feet feet_{};  // from the middle [m]
    std::array<Vector, kCorners> corners_{};
    std::array<double, kFeet> loads_;  // on the feet in the last step [N]
};

}  // namespace swarmevo

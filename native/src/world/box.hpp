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

    // Before a step is laid out for the first time. `is_still`: it neither moved nor changed its speed in the last one.
    void expect(bool is_still);

    // Where the contacts of the step that is laid out find it.
    void stand(const Place& place);

    // In the step that is laid out it is a wall.
    bool stands() const { return stands_; }

    // Of a step in which it may move.
    void add_to(CompliantStep& step);
    void add_to(Contacts& contacts);

    // After the step: does floor and walls hold a box that stands against what others do to it? Was the friction of one
    // that moves Coulomb's? (`by_ode`: else it is.) If not, the step is to be laid out anew, with what this one showed.
    bool fits(const Load& load, bool by_ode);

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
    bool holds(Load load);
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

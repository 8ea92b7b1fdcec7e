// SPDX-License-Identifier: BSD-3-Clause
// What a body on some feet holds out against, by Coulomb friction alone: its limit curve, exactly.
//
// Feet at r_i with the friction limits L hold against a load W (a force and a torque) as long as no motion t (a
// velocity and a spin) gains more work from the load than the feet take:
//
//   W . t <= D(t) = sum of L |velocity of foot i|    for all t
//
// Goyal, Ruina, Papadopoulos: Planar sliding with dry friction, Wear 143 (1991). The usual ellipsoid is up to 12 % too
// strong for four feet.
#pragma once

#include <array>

#include "epuck.hpp"

namespace swarmevo {

// In the plane, about the body's middle.
struct Load {
    double x, y;    // force [N]
    double torque;  // [N m]
};
struct Hold {
    double factor;  // by which the load may grow until the feet give way; infinity without a load
    Twist motion;   // how they then begin to slip, of any length
};

using Feet = std::array<Vector, 4>;  // from the middle [m]

// Minimises D(t) over W . t = 1, to `precision` of the factor, or until it is known whether it is below 1.
Hold hold_of(const Feet& feet, double limit, const Load& load, double precision);

}  // namespace swarmevo

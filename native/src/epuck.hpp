// SPDX-License-Identifier: BSD-3-Clause
// The robot: where its wheels and casters are and how a command drives it.
//
// Body frame: origin at the centre of mass, x forward, y left, z up. How it is built in ODE: world/drive.hpp.
#pragma once

#include <array>
#include <cmath>

#include "scene/scene.hpp"

namespace swarmevo {

using Vector = std::array<double, 3>;

// Of a vector in the plane; faster than std::hypot, whose care for huge values nothing here needs.
inline double norm(double x, double y) {
    return std::sqrt(x * x + y * y);
}

// A solid upright cylinder's moments of inertia about its centre [kg m^2].
// Simplification: the real robot's mass is not spread evenly; its makers give no inertia.
struct Inertia {
    double horizontal, vertical;
};
Inertia robot_inertia(const swe_robot_config& robot);

enum Side { left = 0, right = 1 };

// Of the robot's mass in each wheel, where wheels are bodies of their own: about 5 g of 80 g.
constexpr double kWheelShare = 0.06;

// Centre of a wheel in the body frame [m].
Vector wheel_centre(const swe_robot_config& robot, Side side);

// The front (+1) or rear (-1) caster's tip in the body frame [m].
Vector caster_tip(const swe_robot_config& robot, int direction);

// Rim speed [m/s] for a command in [-1, 1] and a relative error of the motor.
double rim_speed(const swe_robot_config& robot, double command, double error);

// The largest force along its heading that the robot can push with [N]. Its own friction tips it onto a caster, which
// so carries N = F h / a (h: height of the push and of the centre of mass; a: caster to axle); F = mu (m g - N).
double traction_limit(const Scene& scene);

}  // namespace swarmevo

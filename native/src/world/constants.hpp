// SPDX-License-Identifier: BSD-3-Clause
// Tolerances of the physics, each with what it was tuned for. Lengths and speeds are those of robots like the E-puck;
// scene/validation.cpp refuses what is too fast for them. What an experiment may want to change is in
// swe_physics_config instead.
#pragma once

namespace swarmevo {

// ---- the length of a step (step.cpp, assume/) ----

// Error that a body in touch may make in a step [m]: its change of speed, by which it may move half a step too early or
// too late. docs/validation.md, "Where bodies meet": the cases there keep to 2 % of the way and 2 degrees.
constexpr double kPositionError = 5e-4;
// The same with rigid bumpers: a rigid impact moves the box by 0.2 mm in all, and is to be right within a tenth.
constexpr double kRigidPositionError = 2e-6;
// Depth to which bumpers may be pressed in by the end of the step in which they meet [m]. Deeper, and it is cut where
// they meet: before, there is nothing to push, and forces of a step that begins apart are too weak.
constexpr double kImpactDepth = 1e-4;
// A step that is to be cut to this share or less is cut before anything else is mended.
constexpr double kUrgentCut = 0.25;
// No step is cut below this [s].
constexpr double kShortestStep = 1e-4;
// Farthest that a body that was thrown moves in one step [m], since contacts are those of its beginning.
constexpr double kThrownDistance = 1e-3;
// How often a step of one length is tried with better guesses before it is accepted as it is.
constexpr int kMostTries = 8;
// How often a step is halved at most where ODE's solver stalls.
constexpr int kMostHalvings = 4;

// ---- Newton's method (compliant.cpp, compliant_newton.cpp) ----

// Largest ratio of a step to the one before at which it is of second order: beyond 1 + sqrt(2) it would be unstable.
constexpr double kLargestGrowth = 2.3;
// Change of a robot's rim speeds, both together, from which its acceleration jumps [m/s]: a twelfth of what it can be.
constexpr double kSpeedJump = 0.02;
// Slip by which friction of what sticks changes from none to its limit [m/s]: 10 um in a step of 50 ms.
constexpr double kStickSlip = 2e-4;
// Square of the share of its limit below which friction did stick.
constexpr double kSticking = 0.96;
// Share of a robot's traction by which a body's forces may miss their balance.
constexpr double kForceError = 2e-3;
// Rounds of Newton's method, which takes 2 to 6; then ODE solves the step.
constexpr int kMostRounds = 25;
// Slope that a whole step of Newton's method may leave, as a share of the slope at its start.
constexpr double kSlopeLeft = 0.2;
// Slopes that a line search tries, beside those at jumps.
constexpr int kMostSlopes = 4;
// Share of the way to where friction jumps at which it has not jumped yet.
constexpr double kBeforeKink = 0.01;

// ---- friction with the floor, solved by ODE (rub.cpp) ----

// What sticks creeps at this speed where friction is at its limit [m/s]: without it, rows of the contact problem that
// stick along one line would tie, and ODE's solver stall.
constexpr double kCreep = 1e-5;
// Share of its limit by which friction may miss Coulomb's law before the step is solved again.
constexpr double kRubError = 0.02;
// Error of a slip that does not matter [m/s].
constexpr double kSlightSlip = 2e-4;
// A slip that turned from its guess by more than this cosine is looked for along the force.
constexpr double kLargeTurn = 0.95;

// ---- bodies that may meet (average.hpp) ----

// A gap that closes only where pushes by others add more than this to what its bodies do and are driven to do is taken
// for open [m/s].
constexpr double kPushAllowance = 0.02;
// Gap that may be closed in any step, however short [m].
constexpr double kSlack = 1e-4;
// Bodies this near to each other touch [m].
constexpr double kContactGap = 1e-5;
// Overlap of two sprung bumpers, or of a bumper and what it meets, that no contact knew of, at most [m]: a twentieth of
// what a robot that pushes makes.
constexpr double kUnnoticedOverlap = 2.5e-4;

// ---- rest ----

// A body slower than this [m/s], [rad/s], that would take longer than this to gain as much [s], has settled.
constexpr double kRestingSpeed = 2e-5, kRestingSpin = 2e-4, kSettling = 0.1;
// A body slower than this stops [m/s], [rad/s]: friction would halve its speed for ever, until it cannot be divided by.
constexpr double kLeastSpeed = 1e-15;
// A wall this near is touched by a box that stands [m].
constexpr double kTouchingGap = 1e-6;

// ---- ODE's contacts (ode.cpp) ----

// By how much one of two equal limits of friction is to exceed the other, relatively: surfaces that slip in the same
// instant tie rows of the contact problem, and ODE's solver stalls. Far above rounding, far below any figure of
// friction.
constexpr double kTieBreak = 1e-9;

// Speed at which overlaps are pushed apart, at most [m/s]: about a robot's top speed.
constexpr double kLargestCorrection = 0.1;
// The share of an overlap that is pushed apart in a step takes at least this long [s]: in shorter steps of an impact it
// would make bodies bounce.
constexpr double kCorrectionTime = 5e-3;
// Gap that a contact leaves to be closed at least [m]. One that touches and does not move would otherwise be on the
// very edge between pressing and parting, where ODE's solver stalls.
constexpr double kTouch = 1e-10;

}  // namespace swarmevo

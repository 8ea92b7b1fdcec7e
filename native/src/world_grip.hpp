// SPDX-License-Identifier: BSD-3-Clause
// Coulomb friction of a wheel that rolls, slips along or slips across.
#pragma once

#include <cmath>

namespace swarmevo {

// How a wheel's friction divides between its rolling direction and the one across. ODE limits each by itself, to a
// pyramid in whose corners a wheel would pull 1.4 times as hard. One that slips rubs against its slip: so each
// direction gets the slip's share of the limit, and both together are Coulomb's circle.
class Grip {
  public:
    // `time_step` of the scene: over about this time the direction of slip is smoothed [s].
    explicit Grip(double time_step) : memory_(time_step) {}

    // What the foot did in a step of this length [s], which is over: its velocity over the floor [m/s].
    void note_slip(double along, double across, double time_step) {
        const bool slips = std::hypot(along, across) > kGripSpeed;
        const double weight = grips_ ? 1 : time_step / (time_step + memory_);
        if (slips) angle_ += weight * (angle(along, across) - angle_);
        grips_ = !slips;
        leaps_ = 0;
    }

    // Did the foot leap to a side in a step that was tried [m/s]? Then it gets more friction across, for another try.
    bool leapt(double along, double across) {
        const double turn = angle(along, across) - angle_;
        if (grips_ || std::abs(across) < kLeapSpeed || turn < kLeapTurn || leaps_ == kMostLeaps) return false;
        angle_ += turn / 2;
        ++leaps_;
        return true;
    }

    // Shares of the limit.
    double along() const { return grips_ ? 1 : std::cos(angle_); }
    double across() const { return grips_ ? 1 : std::sin(angle_); }

  private:
    // A foot that slips slower than this grips [m/s].
    static constexpr double kGripSpeed = 0.03;
    // One that comes to slip sideways faster than this [m/s], with its slip turned by more than this [rad], leapt:
    // friction against it was missing till the end of the step. It may have so many tries in a step.
    static constexpr double kLeapSpeed = 0.1, kLeapTurn = 0.5;
    static constexpr int kMostLeaps = 3;

    static double angle(double along, double across) { return std::atan2(std::abs(across), std::abs(along)); }

    double memory_;
    bool grips_ = true;
    int leaps_ = 0;     // in the step that is taken
    double angle_ = 0;  // of the slip to the rolling direction, smoothed [rad]
};

}  // namespace swarmevo

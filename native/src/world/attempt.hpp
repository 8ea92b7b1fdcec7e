// SPDX-License-Identifier: BSD-3-Clause
// One way of taking a step, until all that it assumed comes true (assumption.hpp).
#pragma once

namespace swarmevo {

// Which solver found the velocities after a step.
enum class Solver {
    none,  // nothing had to be solved for
    newton,
    ode,
};

struct Attempt {
    explicit Attempt(double length) : time_step(length) {}

    double time_step;         // [s]
    double uncut_length = 0;  // before it was cut at an impact [s]; 0: it was not
    bool is_new = true;       // the first of this length
    int tries = 0;            // of this length, in which an assumption failed

    // Set anew by assumptions before each try:
    bool is_cautious = true;  // all that is near is taken for likely to meet
    bool is_soft = false;     // contacts give a little, and ODE solves for them

    // What the solver did:
    Solver solver = Solver::none;
    unsigned warnings = 0;  // of ODE; its velocities are of no use then

    void cut(double share) {
        time_step *= share;
        is_new = true;
        tries = 0;
    }
};

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
// A step rests on assumptions: that a body needs no solver, that two do not meet, that speeds change little. They are
// made before the step is solved for (step.cpp), and checked after it. Where one did not come true, all bodies are
// taken back to the start of the step, and it is tried again: without the assumption, better informed, or shorter. One
// that follows from what is known before has no check.
//
// To add one: write assume/<name>.cpp, declare its function in assume/list.hpp, add a line to assume/list.cpp and a row
// to benchmarks/assumptions.py, which times the world without it. To delete one: take its line out of the list. No
// assumption knows another.
#pragma once

#include <limits>
#include <memory>
#include <vector>

#include "world/attempt.hpp"

namespace swarmevo {

// What a check found.
struct Finding {
    bool came_true = true;
    bool is_final = false;  // nothing that others found matters, and no more of them are checked
    double share = 1;       // below 1: the step is too long, and is to be cut to this share of its length
};

// Its functions are called in the order in which they stand here.
class Assumption {
  public:
    Assumption() = default;
    virtual ~Assumption() = default;
    Assumption(const Assumption&) = delete;
    Assumption& operator=(const Assumption&) = delete;

    // Between two steps: the longest for which it is likely to come true [s].
    virtual double longest_step() const { return std::numeric_limits<double>::infinity(); }

    // Before each try: what is to be known when contacts are looked for.
    virtual void before_contacts(Attempt&) {}

    // Contacts are known, all robots' Role is `solved`: who needs no solver?
    virtual void before_solving(Attempt&) {}

    // Did it come true? If not, it sees to it that the next try goes without it, or with what this one showed. Every
    // assumption is checked, in the order of the list, whatever those before it found, but for `is_final`.
    virtual Finding check(Attempt&) { return {}; }

    // After a step that holds, with all bodies moved that were solved for: ready for the next one.
    virtual void accept(const Attempt&) {}
};

using Assumptions = std::vector<std::unique_ptr<Assumption>>;

}  // namespace swarmevo

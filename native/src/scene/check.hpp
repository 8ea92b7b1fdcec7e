// SPDX-License-Identifier: BSD-3-Clause
// Collects what is wrong with a configuration, and the parts of its validation that have files of their own.
#pragma once

#include <cmath>
#include <cstdio>
#include <string>

#include "swarmevo.h"

namespace swarmevo {

inline std::string number(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.10g", value);
    return text;
}

// Collects every error of a config.
class Check {
  public:
    void fail(const std::string& message) { errors_ += (errors_.empty() ? "" : "; ") + message; }

    bool range(const std::string& field, double value, double low, double high, const char* unit) {
        if (value >= low && value <= high) {                          // false for NaN
            if (std::fpclassify(value) != FP_SUBNORMAL) return true;  // has few digits: solvers do not converge
            fail(field + ": expected 0 or a number that arithmetic resolves, got " + number(value) + ": set 0");
            return false;
        }
        const std::string came = std::isnan(value) ? "not a number (not set?)" : number(value);
        const std::string space = *unit ? " " : "";
        fail(field + ": expected " + number(low) + " to " + number(high) + space + unit + ", got " + came);
        return false;
    }

    template <std::size_t n>
    bool ranges(const std::string& field, const double (&values)[n], double low, double high, const char* unit) {
        return ranges(field, values, n, low, high, unit);
    }

    // The first n of a list.
    bool ranges(const std::string& field, const double* values, unsigned n, double low, double high, const char* unit) {
        bool good = true;
        for (unsigned i = 0; i < n; ++i)
            good &= range(field + "[" + std::to_string(i) + "]", values[i], low, high, unit);
        return good;
    }

    void choice(const std::string& field, int value, int last) {
        if (value < 1 || value > last)
            fail(field + ": not set, or not one of its SWE_ constants (" + number(value) + ")");
    }

    // Is `whole` a positive multiple of `part`?
    void multiple(const std::string& field, double whole, const char* part_name, double part) {
        const double ratio = whole / part, nearest = std::round(ratio);
        if (nearest < 1 || std::abs(ratio - nearest) > 1e-6)
            fail(field + ": expected a whole number of " + part_name + " (" + number(part) + " s), got " +
                 number(whole) + " s");
    }

    bool passed() const { return errors_.empty(); }
    const std::string& errors() const { return errors_; }

  private:
    std::string errors_;
};

void check_robot(Check& check, const swe_robot_config& robot, const swe_physics_config& physics);

void check_sensors(Check& check, const swe_scene_config& config);

// `world_is_sound`: all else passed, so that places can be looked for.
void check_team(Check& check, const swe_scene_config& config, bool world_is_sound);

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
// CompliantStep: Newton's method for one group of bodies that touch.
#include <algorithm>
#include <cmath>

#include "error.hpp"
#include "world/compliant.hpp"
#include "world/constants.hpp"

namespace swarmevo {

bool CompliantStep::solve_group(int group) {
    group_bodies_.clear();
    group_feet_.clear();
    group_touches_.clear();
    for (std::size_t i = 0; i < bodies_.size(); ++i)
        if (root(static_cast<int>(i)) == group) {
            bodies_[i].row = 3 * static_cast<int>(group_bodies_.size());
            group_bodies_.push_back(&bodies_[i]);
        }
    for (Foot& foot : feet_)
        if (root(foot.body) == group) group_feet_.push_back(&foot);
    for (Touch& touch : touches_)
        if (root(std::max(touch.ends[0].body, touch.ends[1].body)) == group) group_touches_.push_back(&touch);

    velocity_.resize(3 * static_cast<Eigen::Index>(group_bodies_.size()));
    for (const Body* body : group_bodies_)
        for (int k = 0; k < 3; ++k) velocity_[body->row + k] = body->guess[k];
    evaluate(0);
    if (!residual_.allFinite()) throw Error(SWE_PHYSICS_ERROR, "a force is not finite");
    for (int round = 0; round < kMostRounds; ++round) {
        if (update_loads()) evaluate(0);
        if (is_balanced()) {
            for (Body* body : group_bodies_)
                for (int k = 0; k < 3; ++k) body->after[k] = velocity_[body->row + k];
            return true;
        }
        assemble();
        find_way();
        const double share = line_search();  // the last one to be evaluated
        velocity_ += share * way_;
        if (!velocity_.allFinite()) return false;
    }
    return false;
}

bool CompliantStep::is_balanced() const {
    return std::all_of(group_bodies_.begin(), group_bodies_.end(), [&](const Body* body) {
        const double* r = &residual_[body->row];
        const double gyration = std::sqrt(body->inertia / body->mass);
        return std::abs(r[0]) + std::abs(r[1]) + std::abs(r[2]) / gyration < force_error_;
    });
}

// Forces that are missing for a balance at these velocities, [N] and [N m].
void CompliantStep::evaluate(double share) {
    const Eigen::VectorXd& v = share == 0 ? velocity_ : (trial_ = velocity_ + share * way_);
    residual_.resize(v.size());
    for (const Body* body : group_bodies_) {
        const int row = body->row;
        const double rate = body->gain / time_step_;
        residual_[row] = body->mass * rate * (v[row] - body->from[0]);
        residual_[row + 1] = body->mass * rate * (v[row + 1] - body->from[1]);
        residual_[row + 2] = body->inertia * rate * (v[row + 2] - body->from[2]);
    }
    for (Foot* foot : group_feet_) {
        const int row = bodies_[foot->body].row;
        foot->slip_x = v[row] - v[row + 2] * foot->arm_y - foot->surface_x;
        foot->slip_y = v[row + 1] + v[row + 2] * foot->arm_x - foot->surface_y;
        foot->law = foot->rub->law(foot->slip_x, foot->slip_y);
        residual_[row] -= foot->law.fx;
        residual_[row + 1] -= foot->law.fy;
        residual_[row + 2] -= foot->arm_x * foot->law.fy - foot->arm_y * foot->law.fx;
    }
    for (Touch* touch : group_touches_) {
        double parting = 0, sliding = 0;
        for (const End& end : touch->ends) {
            if (end.body < 0) continue;
            const double* u = &v[bodies_[end.body].row];
            parting += u[0] * end.normal[0] + u[1] * end.normal[1] + u[2] * end.normal[2];
            sliding += u[0] * end.tangent[0] + u[1] * end.tangent[1] + u[2] * end.tangent[2];
        }
        touch->closing = -parting;
        touch->sliding = sliding;
        const double bumper = touch->stiffness * (touch->push_out - parting);
        const double stop = contacts_.rigidity() * (touch->stop_push_out - parting);
        touch->press = std::max(0.0, bumper) + std::max(0.0, stop);
        touch->stops = stop > 0;
        touch->rate = (bumper > 0 ? touch->stiffness : 0) + (stop > 0 ? contacts_.rigidity() : 0);
        const double limit = touch->pair->side_friction * touch->press;
        const double drag = touch->pair->rubbing - limit / kStickSlip * sliding;
        touch->drag = std::clamp(drag, -limit, limit);
        touch->sticks = std::abs(drag) < limit;
        if (touch->press == 0) continue;
        for (const End& end : touch->ends) {
            if (end.body < 0) continue;
            double* r = &residual_[bodies_[end.body].row];
            for (const int k : {0, 1, 2}) r[k] -= touch->press * end.normal[k] + touch->drag * end.tangent[k];
        }
    }
}

// Of a body's row and another's column in the group's system; none where it was not asked for since assemble() began.
Eigen::Matrix3d& CompliantStep::block(int row, int column) {
    const std::size_t at = row / 3 * group_bodies_.size() + column / 3;
    if (!coupled_[at]) blocks_[at].setZero();
    coupled_[at] = true;
    return blocks_[at];
}

// Derivative of the residual. Where a side slips, its friction grows with what presses there: that couples so strongly
// that leaving it to update_loads() would take many rounds.
void CompliantStep::assemble() {
    const std::size_t size = group_bodies_.size() * group_bodies_.size();
    coupled_.assign(size, false);
    if (blocks_.size() < size) blocks_.resize(size);
    for (const Body* body : group_bodies_) {
        const double rate = body->gain / time_step_;
        block(body->row, body->row).diagonal() << body->mass * rate, body->mass * rate, body->inertia * rate;
    }
    for (const Foot* foot : group_feet_) {
        const Rub::Law& d = foot->law;
        const double x = foot->arm_x, y = foot->arm_y;
        const double turn_x = d.dxy * x - d.dxx * y, turn_y = d.dyy * x - d.dxy * y;
        Eigen::Matrix3d change;
        change << d.dxx, d.dxy, turn_x, d.dxy, d.dyy, turn_y, turn_x, turn_y, x * turn_y - y * turn_x;
        const int row = bodies_[foot->body].row;
        block(row, row) += change;
    }
    for (const Touch* touch : group_touches_) {
        if (touch->press == 0) continue;
        const double mu = touch->pair->side_friction;
        const double stick = touch->sticks ? mu * touch->press / kStickSlip : 0;
        const double couple = touch->sticks || touch->drag == 0 ? 0 : std::copysign(mu * touch->rate, touch->drag);
        for (const End& a : touch->ends) {
            if (a.body < 0) continue;
            for (const End& b : touch->ends) {
                if (b.body < 0) continue;
                block(bodies_[a.body].row, bodies_[b.body].row) +=
                    (touch->rate * a.normal + couple * a.tangent) * b.normal.transpose() +
                    stick * a.tangent * b.tangent.transpose();
            }
        }
    }
}

// Solves the linear system: by elimination of one body after the other, whose block its mass and its friction keep from
// being singular. Most bodies touch few others, and the box, which touches most, is the last.
void CompliantStep::find_way() {
    const std::size_t n = group_bodies_.size();
    way_ = -residual_;
    for (std::size_t k = 0; k < n; ++k) {
        Eigen::Matrix3d& pivot = blocks_[k * n + k];
        pivot = pivot.inverse().eval();
        for (std::size_t i = k + 1; i < n; ++i) {
            if (!is_coupled(i, k)) continue;
            const Eigen::Matrix3d share = blocks_[i * n + k] * pivot;
            for (std::size_t j = k + 1; j < n; ++j)
                if (is_coupled(k, j)) {
                    const Eigen::Matrix3d change = share * blocks_[k * n + j];
                    block(3 * static_cast<int>(i), 3 * static_cast<int>(j)) -= change;
                }
            way_.segment<3>(3 * i) -= share * way_.segment<3>(3 * k);
        }
    }
    for (std::size_t k = n; k-- > 0;) {
        Eigen::Vector3d rest = way_.segment<3>(3 * k);
        for (std::size_t j = k + 1; j < n; ++j)
            if (is_coupled(k, j)) rest -= blocks_[k * n + j] * way_.segment<3>(3 * j);
        way_.segment<3>(3 * k) = blocks_[k * n + k] * rest;
    }
}

// Friction is limited by what presses now. Did that change anything?
bool CompliantStep::update_loads() {
    bool changed = false;
    for (Body* body : group_bodies_)
        if (body->drive) {
            double forces[2][2];
            int i = 0;
            for (const Foot* foot : group_feet_)
                if (&bodies_[foot->body] == body && i < 2) {
                    forces[i][0] = foot->law.fx;
                    forces[i++][1] = foot->law.fy;
                }
            changed |= body->drive->share_loads(forces);
        }
    return changed;
}

// Shares of the way at which a foot or a side stops and turns back: there friction jumps. After the whole way was
// evaluated.
void CompliantStep::find_kinks() {
    const Eigen::VectorXd& way = way_;
    kinks_.clear();
    const auto add = [&](double at) {
        if (at > 0 && at < 1) kinks_.push_back(at);
    };
    for (const Foot* foot : group_feet_) {
        const int row = bodies_[foot->body].row;
        const double dx = way[row] - way[row + 2] * foot->arm_y, dy = way[row + 1] + way[row + 2] * foot->arm_x;
        const double square = dx * dx + dy * dy;
        if (square > 0) add(1 - (foot->slip_x * dx + foot->slip_y * dy) / square);
    }
    for (const Touch* touch : group_touches_) {
        double change = 0;
        for (const End& end : touch->ends)
            if (end.body >= 0) change += end.tangent.dot(way.segment<3>(bodies_[end.body].row));
        if (change != 0) add(1 - touch->sliding / change);
    }
    std::sort(kinks_.begin(), kinks_.end());
}

// How far to go. The slope along the way rises; where it jumps, the minimum may well be.
double CompliantStep::line_search() {
    const double start = residual_.dot(way_), enough = kSlopeLeft * std::abs(start);  // start < 0
    const auto slope = [&](double share) {
        evaluate(share);
        return residual_.dot(way_);
    };
    double low = 0, low_slope = start, high = 1, high_slope = slope(1);
    if (high_slope <= enough) return 1;
    find_kinks();
    for (const double at : kinks_) {
        const double here = slope(at);
        if (here <= 0) {
            low = at;
            low_slope = here;
            continue;
        }
        // Does it fall up to this kink?
        const double before = slope(at - kBeforeKink * (at - low));
        if (before <= 0) {
            evaluate(at);
            return at;
        }
        high = at;
        high_slope = before;
        break;
    }
    double share = high;
    for (int i = 0; i < kMostSlopes; ++i) {
        // False position, held off the ends, where a bend would make it crawl.
        const double width = high - low, linear = low_slope / (low_slope - high_slope);
        share = low + width * std::clamp(linear, 0.1, 0.9);
        const double here = slope(share);
        if (std::abs(here) <= enough) break;
        (here < 0 ? low : high) = share;
        (here < 0 ? low_slope : high_slope) = here;
    }
    return share;
}

}  // namespace swarmevo

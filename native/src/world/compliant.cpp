// SPDX-License-Identifier: BSD-3-Clause
#include "world/compliant.hpp"

#include <algorithm>
#include <cmath>

#include "world/constants.hpp"

namespace swarmevo {

void CompliantStep::begin(double time_step) {
    time_step_ = time_step;
    bodies_.clear();
    feet_.clear();
    touches_.clear();
    index_.assign(index_.size(), -1);
}

void CompliantStep::add_body(int number, dBodyID id, const Place& place, Drive* drive) {
    dMass mass;
    dBodyGetMass(id, &mass);
    const dReal *v = dBodyGetLinearVel(id), *w = dBodyGetAngularVel(id);
    const int at = static_cast<int>(bodies_.size());
    if (number >= static_cast<int>(index_.size())) {
        index_.resize(number + 1, -1);
        past_.resize(number + 1);
    }
    index_[number] = at;
    bodies_.push_back({id,
                       number,
                       drive,
                       mass.mass,
                       mass.I[10],
                       place.x,
                       place.y,
                       1,
                       {},
                       {v[0], v[1], w[2]},
                       {v[0], v[1], w[2]},
                       {},
                       at,
                       0});
    use_second_order(bodies_.back());
    if (!drive || !drive->sticks()) return;
    const Twist guess = drive->intended_motion();
    for (int k = 0; k < 3; ++k) bodies_.back().guess[k] = k == 0 ? guess.x : k == 1 ? guess.y : guess.spin;
}

void CompliantStep::use_euler(Body& body) {
    body.gain = 1;
    std::copy_n(body.before, 3, body.from);
}

void CompliantStep::use_second_order(Body& body) const {
    const Past& past = past_[body.number];
    const double ratio = past.time_step > 0 ? time_step_ / past.time_step : kLargestGrowth + 1;
    if (ratio > kLargestGrowth) return use_euler(body);
    body.gain = (1 + 2 * ratio) / (1 + ratio);
    for (int k = 0; k < 3; ++k)
        body.from[k] = ((1 + ratio) * body.before[k] - ratio * ratio / (1 + ratio) * past.before[k]) / body.gain;
}

void CompliantStep::remember() {
    forget();
    for (const Body& body : bodies_) {
        std::copy_n(body.before, 3, past_[body.number].before);
        past_[body.number].time_step = time_step_;
    }
    for (const Touch& touch : touches_) {
        const bool touched = touch.pair->gap < kContactGap;
        const bool presses = touch.press > 0;
        if (touched == presses && !touch.stops) continue;
        for (const End& end : touch.ends)
            if (end.body >= 0) forget(bodies_[end.body].number);
    }
}

void CompliantStep::forget() {
    for (Past& past : past_) past.time_step = 0;
}

void CompliantStep::forget(int number) {
    if (number < static_cast<int>(past_.size())) past_[number].time_step = 0;
}

void CompliantStep::add_rub(Rub& rub, const Vector& arm, const Vector& surface) {
    const int body = static_cast<int>(bodies_.size()) - 1;
    feet_.push_back({&rub, body, arm[0], arm[1], surface[0], surface[1], 0, 0, {}});
}

void CompliantStep::add_pair(Sides::Pair& pair) {
    const auto place = [&](int number) {
        return number < 0 || number >= static_cast<int>(index_.size()) ? -1 : index_[number];
    };
    Touch touch{};
    touch.pair = &pair;
    const double nx = pair.normal[0], ny = pair.normal[1];
    for (const int i : {0, 1}) {
        End& end = touch.ends[i];
        end.body = place(i == 0 ? pair.first : pair.second);
        if (end.body < 0) continue;
        const double sign = i == 0 ? 1 : -1, x = pair.point[0] - bodies_[end.body].x,
                     y = pair.point[1] - bodies_[end.body].y;
        end.normal << sign * nx, sign * ny, sign * (x * ny - y * nx);
        end.tangent << -sign * ny, sign * nx, sign * (x * nx + y * ny);
    }
    const int first = touch.ends[0].body, second = touch.ends[1].body;
    if (first < 0 && second < 0) return;
    touch.stiffness = pair.spring.whole(time_step_);
    touch.push_out = pair.spring.push_out(pair.gap, pair.closing, time_step_);
    touch.stop_push_out = contacts_.push_out(pair.gap + pair.travel);
    touches_.push_back(touch);
    // An impact begins.
    if (pair.travel <= 0 || (pair.load <= 0 && pair.gap < kContactGap))
        for (const int body : {first, second})
            if (body >= 0) use_euler(bodies_[body]);
    contacts_.note_overlap(-pair.gap - pair.travel);
    if (first >= 0 && second >= 0) bodies_[root(second)].group = root(first);
}

int CompliantStep::root(int body) const {
    while (bodies_[body].group != body) body = bodies_[body].group;
    return body;
}

bool CompliantStep::solve() {
    for (std::size_t i = 0; i < bodies_.size(); ++i)
        if (bodies_[i].group == static_cast<int>(i) && !solve_group(static_cast<int>(i))) return false;
    // Only now: where a group has no solution, ODE begins with the velocities before.
    for (const Body& body : bodies_) {
        dBodySetLinearVel(body.id, body.after[0], body.after[1], 0);
        dBodySetAngularVel(body.id, 0, 0, body.after[2]);
    }
    for (const Foot& foot : feet_) foot.rub->remember(foot.law.fx, foot.law.fy);
    for (const Touch& touch : touches_) {
        const Vector& n = touch.pair->normal;
        touch.pair->force = {touch.press * n[0] - touch.drag * n[1], touch.press * n[1] + touch.drag * n[0], 0};
    }
    return true;
}

}  // namespace swarmevo

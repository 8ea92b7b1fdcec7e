// SPDX-License-Identifier: BSD-3-Clause
#include "world/step.hpp"

#include <algorithm>
#include <cmath>

#include "world/constants.hpp"

namespace swarmevo {
namespace {

Sides::Solid solid(const Robot& robot) {
    return {robot.drive->body(), robot.number, 1};
}

void set_enabled(dBodyID body, bool enabled) {
    if (enabled)
        dBodyEnable(body);
    else
        dBodyDisable(body);
}

void stop_if_still(dBodyID body) {
    const dReal *v = dBodyGetLinearVel(body), *w = dBodyGetAngularVel(body);
    if (std::abs(v[0]) + std::abs(v[1]) + std::abs(v[2]) > kLeastSpeed) return;
    if (std::abs(w[0]) + std::abs(w[1]) + std::abs(w[2]) > kLeastSpeed) return;
    dBodySetLinearVel(body, 0, 0, 0);
    dBodySetAngularVel(body, 0, 0, 0);
}

bool nothing_to_solve(const State& state) {
    const auto is_solved = [](const Robot& robot) { return robot.role == Role::solved; };
    const auto stands = [](const Movable& movable) { return movable.stands(); };
    return std::all_of(state.movables.begin(), state.movables.end(), stands) &&
           std::none_of(state.robots.begin(), state.robots.end(), is_solved);
}

}  // namespace

void Stepper::advance() {
    for (double left = state_.scene.physics.time_step; left > kShortestStep / 2;)
        left -= step(left / std::ceil(left / longest_step() - 1e-6));
}

double Stepper::longest_step() const {
    double longest = state_.scene.physics.time_step;
    for (const auto& assumption : assumptions_) longest = std::min(longest, assumption->longest_step());
    return longest;
}

// Takes a step of this length [s], or a shorter one where it must. Returns how long it was.
double Stepper::step(double time_step) {
    save_bodies();
    Attempt attempt(time_step);
    for (;;) {
        lay_out(attempt);
        solve(attempt);
        if (holds(attempt)) break;
        restore_bodies();
    }
    accept(attempt);
    return attempt.time_step;
}

// What meets in the step, and who is to be solved for.
void Stepper::lay_out(Attempt& attempt) {
    for (const auto& assumption : assumptions_) assumption->before_contacts(attempt);
    if (attempt.is_new) expect_present_motion();
    attempt.is_new = false;
    find_contacts(attempt);
    for (const auto& assumption : assumptions_) assumption->before_solving(attempt);
    for (const Robot& robot : state_.robots) set_enabled(robot.drive->body(), robot.role == Role::solved);
    for (const Movable& movable : state_.movables) set_enabled(movable.body(), !movable.stands());
    find_contacts_of_movables();
}

// Feet and wheels are first expected to slip as they do now.
void Stepper::expect_present_motion() {
    for (Movable& movable : state_.movables) movable.expect();
    for (Robot& robot : state_.robots) robot.drive->expect();
}

// Of robots with walls, with those before them, with movables and obstacles.
void Stepper::find_contacts(const Attempt& attempt) {
    AverageVelocity& average = state_.average;
    Sides& sides = state_.sides;
    std::vector<Robot>& robots = state_.robots;
    average.begin(attempt.time_step, attempt.is_cautious);
    sides.begin();
    for (Movable& movable : state_.movables) movable.place_at(average.place(movable.number()));
    for (Robot& robot : robots) {
        const Twist aim = robot.drive->intended_motion();
        average.intend(robot.number, aim.x, aim.y);
        robot.is_free = true;
        robot.role = Role::solved;
    }
    for (Robot& robot : robots) {
        if (sides.add_robot_at_walls(solid(robot))) robot.is_free = false;
        for (int i = 0; i < robot.number; ++i)
            if (sides.add_robots(solid(robot), solid(robots[i]))) robot.is_free = robots[i].is_free = false;
        for (std::size_t i = 0; i < state_.movables.size(); ++i)
            if (sides.add_push(solid(robot), state_.movables[i], static_cast<int>(i))) robot.is_free = false;
        if (sides.add_robot_at_obstacles(solid(robot))) robot.is_free = false;
    }
}

// Of those that may move with walls, obstacles and each other.
void Stepper::find_contacts_of_movables() {
    const std::vector<Movable>& movables = state_.movables;
    for (std::size_t i = 0; i < movables.size(); ++i) {
        const int number = static_cast<int>(i);
        if (!movables[i].stands()) {
            state_.sides.add_movable_at_walls(movables[i], number);
            state_.sides.add_movable_at_obstacles(movables[i], number);
        }
        for (int j = 0; j < number; ++j)
            if (!movables[i].stands() || !movables[j].stands())
                state_.sides.add_movables(movables[i], number, movables[j], j);
    }
}

// Finds the velocities after the step: of level bodies by Newton's method, or by ODE where its rounds do not come to an
// end; of the articulated drive by ODE.
void Stepper::solve(Attempt& attempt) {
    attempt.warnings = 0;
    if (nothing_to_solve(state_)) {
        attempt.solver = Solver::none;
    } else if (state_.is_level && !attempt.is_soft && solve_by_newton(attempt.time_step)) {
        attempt.solver = Solver::newton;
    } else {
        attempt.solver = Solver::ode;
        attempt.warnings = solve_by_ode(attempt);
        messages_ += attempt.warnings;
    }
    state_.average.read_velocities();
    if (attempt.solver == Solver::ode) state_.sides.read_forces();
}

bool Stepper::solve_by_newton(double time_step) {
    CompliantStep& compliant = state_.compliant;
    state_.contacts.begin(time_step, false);
    compliant.begin(time_step);
    for (Robot& robot : state_.robots) {
        if (robot.role != Role::solved) continue;
        const Place& place = state_.average.place(robot.number);
        compliant.add_body(robot.number, robot.drive->body(), place, robot.drive.get());
        robot.drive->add_to(compliant, place);
    }
    for (Movable& movable : state_.movables) {
        if (movable.stands()) continue;
        compliant.add_body(movable.number(), movable.body(), state_.average.place(movable.number()), nullptr);
        movable.add_to(compliant);
    }
    for (Sides::Pair* pair : state_.sides.pairs()) compliant.add_pair(*pair);
    return compliant.solve();
}

// Returns the warnings of ODE's solver.
unsigned Stepper::solve_by_ode(const Attempt& attempt) {
    Contacts& contacts = state_.contacts;
    contacts.begin(attempt.time_step, attempt.is_soft);
    for (Robot& robot : state_.robots) {
        if (robot.role != Role::solved) continue;
        state_.average.place_body(robot.number);
        robot.drive->add_to(contacts, state_.average.place(robot.number));
    }
    for (Movable& movable : state_.movables) {
        if (movable.stands()) continue;
        state_.average.place_body(movable.number());
        movable.add_to(contacts);
    }
    state_.sides.add_to(contacts);
    return state_.ode.step(attempt.time_step);
}

// Did all that it assumed come true? Where something did not, a step that holds at no try of this length is accepted as
// the last one came out.
bool Stepper::holds(Attempt& attempt) {
    bool all = true;
    double share = 1;
    for (const auto& assumption : assumptions_) {
        const Finding found = assumption->check(attempt);
        if (found.is_final) {
            if (found.share < 1) attempt.cut(found.share);
            return found.came_true;
        }
        all &= found.came_true;
        share = std::min(share, found.share);
    }
    if (share <= kUrgentCut || (share < 1 && all)) {
        attempt.cut(share);
        return false;
    }
    return all || ++attempt.tries == kMostTries;
}

// Moves all bodies.
void Stepper::accept(const Attempt& attempt) {
    const bool by_ode = attempt.solver == Solver::ode;
    if (attempt.warnings > 0) ++unsolved_;
    for (Movable& movable : state_.movables) movable.finish(by_ode);
    state_.sides.finish();
    // The articulated reference runs at steps that need no correction: ODE moved it.
    if (state_.is_level) state_.average.apply();
    for (const dBodyID body : state_.bodies) stop_if_still(body);
    for (Robot& robot : state_.robots) {
        if (by_ode && robot.role == Role::solved) robot.drive->finish();
        robot.is_steady = true;
    }
    for (const auto& assumption : assumptions_) assumption->accept(attempt);
    state_.average.settle();
}

void Stepper::save_bodies() {
    before_.clear();
    for (const dBodyID body : state_.bodies) before_.push_back(state_of(body));
}

void Stepper::restore_bodies() {
    for (std::size_t i = 0; i < before_.size(); ++i) set_state(state_.bodies[i], before_[i]);
}

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
// Contacts are computed in closed form (sides.cpp), and not by ODE's collision code: everything is an upright disc, a
// rectangle, a wall or the floor, and ODE's generic contact points made pushing depend on the time step.
//
// Model
//   - Floor: friction is Coulomb's, in a circle under each wheel and each foot of a movable (rub.hpp). With driven
//     contacts bodies stay level, and what presses on the floor is known by statics; articulated, it is solved for.
//   - Sides: bodies meet in the plane, as discs and rectangles, at one height. A disc's side is a vertical line; the
//     force's centre along it is taken where it tips neither body. Robots meet by their bumpers.
//     Simplification: outlines are those of the upright body; tilts here stay below a few degrees.
//   - A contact is made before touch. It allows no faster approach than closes the gap within the step. So a body
//     never sinks into another by the distance of one step, whatever the time step.
//
// A step (step.cpp)
//   - Contacts are found where the step ends (average.hpp). Level bodies are solved for by Newton's method
//     (compliant.hpp), the articulated drive by ODE (contacts.hpp).
//   - It rests on assumptions (assumption.hpp, assume/), which leave bodies and contacts out, cut it where bumpers meet
//     or speeds change much, and have it tried again where they did not come true.
//
// Speeds and lengths are tuned to the E-puck (constants.hpp); scene/validation.cpp refuses what is too fast for them.
#include "world/world.hpp"

#include <algorithm>

#include "world/assume/list.hpp"
#include "world/state.hpp"
#include "world/step.hpp"

namespace swarmevo {

struct World::Impl {
    State state;
    Stepper stepper{state, all_assumptions(state)};
    Extremes extremes;

    Impl(const Scene& scene, const Starts& starts) : state(scene, starts) {}

    void note_extremes() {
        extremes.penetration = state.contacts.deepest_overlap();
        const auto note = [&](dBodyID body, double resting_height) {
            extremes.lift = std::max(extremes.lift, dBodyGetPosition(body)[2] - resting_height);
            extremes.upright = std::min(extremes.upright, dBodyGetRotation(body)[10]);
        };
        for (const Robot& robot : state.robots) note(robot.drive->body(), robot.resting_heights[0]);
        for (const Movable& movable : state.movables) note(movable.body(), movable.height());
    }
};

World::World(const Scene& scene, const Starts& starts) : impl_(new Impl(scene, starts)) {}
World::~World() = default;

void World::set_rim_speeds(unsigned robot, double left, double right) {
    impl_->state.set_rim_speeds(robot, left, right);
}

void World::step() {
    impl_->stepper.advance();
    impl_->note_extremes();
}

Pose World::robot_pose(unsigned robot) const {
    return pose_of(impl_->state.robots[robot].drive->body());
}
Pose World::movable_pose(unsigned movable) const {
    return pose_of(impl_->state.movables[movable].body());
}

Twist World::movable_motion(unsigned movable) const {
    const dBodyID body = impl_->state.movables[movable].body();
    const dReal* v = dBodyGetLinearVel(body);
    return {v[0], v[1], dBodyGetAngularVel(body)[2]};
}

double World::wheel_speed(unsigned robot, Side side) const {
    return impl_->state.robots[robot].drive->wheel_speed(side);
}

double World::push_force(unsigned robot, unsigned movable) const {
    const Sides::Pair& push = impl_->state.sides.push(static_cast<int>(robot), static_cast<int>(movable));
    return push.may_meet ? push.press() : 0;
}

double World::energy() const {
    return impl_->state.energy();
}
std::uint64_t World::fold_state(std::uint64_t hash) const {
    return impl_->state.fold_into(hash);
}

const Extremes& World::extremes() const {
    return impl_->extremes;
}
unsigned World::ode_messages() const {
    return impl_->stepper.ode_messages();
}
unsigned World::unsolved_steps() const {
    return impl_->stepper.unsolved_steps();
}

}  // namespace swarmevo

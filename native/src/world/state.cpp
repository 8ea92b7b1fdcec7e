// SPDX-License-Identifier: BSD-3-Clause
#include "world/state.hpp"

#include <cmath>
#include <cstring>

#include "error.hpp"
#include "world/constants.hpp"

namespace swarmevo {
namespace {

// Potential above rest and kinetic energy [J].
double energy_of(dBodyID body, double resting_height, double gravity) {
    dMass mass;
    dBodyGetMass(body, &mass);
    const dReal *v = dBodyGetLinearVel(body), *w = dBodyGetAngularVel(body);
    dVector3 spin;
    dBodyVectorFromWorld(body, w[0], w[1], w[2], spin);
    double energy = mass.mass * gravity * (dBodyGetPosition(body)[2] - resting_height);
    for (int i = 0; i < 3; ++i) energy += (mass.mass * v[i] * v[i] + mass.I[5 * i] * spin[i] * spin[i]) / 2;
    return energy;
}

std::uint64_t fold(std::uint64_t hash, double value) {
    std::uint64_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    hash = (hash ^ bits) * 0x9E3779B97F4A7C15u;  // odd, so that no difference is lost
    return hash ^ hash >> 29;
}

}  // namespace

State::State(const Scene& description, const Starts& starts)
    : scene(description),
      is_level(description.physics.drive == SWE_DRIVE_DRIVEN_CONTACTS),
      contacts(ode, description.physics),
      average(is_level),
      sides(description, average),
      compliant(contacts, kForceError * traction_limit(description)) {
    dWorldSetGravity(ode.id(), 0, 0, -scene.physics.gravity);
    dWorldSetERP(ode.id(), scene.physics.contact_erp);
    dWorldSetCFM(ode.id(), scene.physics.contact_cfm);
    dWorldSetAutoDisableFlag(ode.id(), 0);
    movables.reserve(scene.movables.size());  // once: solvers keep pointers to their feet
    for (std::size_t i = 0; i < scene.movables.size(); ++i)
        movables.emplace_back(scene, scene.movables[i], ode.id(), starts.movables[i]);
    robots.resize(starts.robots.size());  // once: ODE keeps pointers to their feedback
    for (std::size_t i = 0; i < robots.size(); ++i) add_robot(robots[i], static_cast<int>(i), starts.robots[i]);
    for (Movable& movable : movables) {
        movable.set_number(average.add_body(movable.body(), movable.limits()));
        bodies.push_back(movable.body());
    }
}

void State::add_robot(Robot& robot, int number, const Pose& start) {
    robot.number = number;
    robot.drive = create_drive(scene, ode.id(), start);
    const double pull = traction_limit(scene);
    const double twist =
        scene.physics.wheel_friction * scene.robot.mass * scene.physics.gravity * scene.robot.axle_length / 2;
    average.add_body(robot.drive->body(),
                     {pull / scene.robot.mass, twist / robot_inertia(scene.robot).vertical, scene.robot.radius});
    for (const dBodyID body : robot.drive->bodies()) {
        bodies.push_back(body);
        robot.resting_heights.push_back(dBodyGetPosition(body)[2]);
    }
}

void State::set_rim_speeds(unsigned number, double left, double right) {
    Robot& robot = robots[number];
    if (robot.drive->speed_change(left, right) > kSpeedJump) compliant.forget(robot.number);
    robot.drive->set_rim_speeds(left, right);
    robot.is_steady = false;
}

double State::energy() const {
    std::vector<Place> places, movable_places;
    for (const Robot& robot : robots) places.push_back(place_of(robot.drive->body()));
    for (const Movable& movable : movables) movable_places.push_back(place_of(movable.body()));
    double sum = sides.stored_energy(places, movable_places);
    for (const Movable& movable : movables) sum += energy_of(movable.body(), movable.height(), scene.physics.gravity);
    for (const Robot& robot : robots)
        for (std::size_t i = 0; i < robot.resting_heights.size(); ++i)
            sum += energy_of(robot.drive->bodies()[i], robot.resting_heights[i], scene.physics.gravity);
    return sum;
}

std::uint64_t State::fold_into(std::uint64_t hash) const {
    for (const dBodyID body : bodies) {
        const BodyState state = state_of(body);
        double sum = 0;  // not finite as soon as one of its terms is not
        for (const auto* values : {state.position, state.velocity, state.spin})
            for (int i = 0; i < 3; ++i) {
                hash = fold(hash, values[i]);
                sum += values[i];
            }
        for (const double value : state.quaternion) {
            hash = fold(hash, value);
            sum += value;
        }
        if (!std::isfinite(sum)) throw Error(SWE_PHYSICS_ERROR, "a body's state is no longer finite");
    }
    return hash;
}

}  // namespace swarmevo

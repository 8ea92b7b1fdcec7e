// SPDX-License-Identifier: BSD-3-Clause
#include "epuck.hpp"

namespace swarmevo {

Inertia robot_inertia(const swe_robot_config& robot) {
    const double r2 = robot.radius * robot.radius, h2 = robot.height * robot.height;
    return {robot.mass * (3 * r2 + h2) / 12, robot.mass * r2 / 2};
}

Vector wheel_centre(const swe_robot_config& robot, Side side) {
    const double y = side == left ? robot.axle_length / 2 : -robot.axle_length / 2;
    return {0, y, robot.wheel_radius - robot.centre_of_mass};
}

Vector caster_tip(const swe_robot_config& robot, int direction) {
    return {direction * robot.caster_offset, 0, robot.caster_clearance - robot.centre_of_mass};
}

double rim_speed(const swe_robot_config& robot, double command, double error) {
    return command * (1 + error) * robot.top_speed * robot.wheel_radius;
}

double traction_limit(const Scene& scene) {
    const double mu = scene.physics.wheel_friction;
    return mu * scene.robot.mass * scene.physics.gravity /
           (1 + mu * scene.robot.centre_of_mass / scene.robot.caster_offset);
}

}  // namespace swarmevo

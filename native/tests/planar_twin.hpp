// SPDX-License-Identifier: BSD-3-Clause
// The independent reference (../reference/planar.hpp) in the place of World: the same scene, the same numbers.
#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include "../../native/reference/planar.hpp"
#include "scene/scene.hpp"

namespace swarmevo {

// Of a world whose robots drive as `World::set_rim_speeds` tells them. The articulated robot has no twin.
class PlanarTwin {
  public:
    explicit PlanarTwin(const Scene& scene)
        : parameters_(parameters_of(scene)), planar_(parameters_, robots_of(scene), box_of(scene)) {}

    void set_rim_speeds(unsigned robot, double left, double right) {
        const double top = parameters_.wheel_top_speed * parameters_.wheel_radius;
        planar_.set_command(robot, left / top, right / top);
    }

    void run(double seconds) { planar_.advance(std::lround(seconds / parameters_.time_step)); }

    Pose robot_pose(unsigned robot) const { return pose(planar_.robot(robot)); }
    Pose movable_pose(unsigned) const { return pose(planar_.box()); }

  private:
    static Pose pose(const swarmevo_reference::Body& body) { return {body.x, body.y, body.heading}; }

    static swarmevo_reference::Parameters parameters_of(const Scene& scene) {
        swarmevo_reference::Parameters p;
        p.arena_size = 2 * scene.arena.bounds()[1];
        p.robot_mass = scene.robot.mass;
        p.robot_radius = scene.robot.radius;
        p.axle = scene.robot.axle_length;
        p.wheel_radius = scene.robot.wheel_radius;
        p.wheel_top_speed = scene.robot.top_speed;
        p.mu_wheel = scene.physics.wheel_friction;
        p.mass_height = scene.robot.centre_of_mass;
        p.caster_offset = scene.robot.caster_offset;
        p.box_mass = scene.movables[0].config.mass;
        p.box_length = scene.movables[0].config.size[0];
        p.box_width = scene.movables[0].config.size[1];
        p.mu_box = scene.movables[0].config.friction;
        p.mu_side = scene.physics.side_friction;
        p.sprung = scene.robot.bumper == SWE_BUMPER_SPRUNG;
        p.bumper_stiffness = scene.robot.bumper_stiffness;
        p.bumper_damping = scene.robot.bumper_damping;
        p.bumper_travel = scene.robot.bumper_travel;
        return p;
    }

    static std::vector<swarmevo_reference::Body> robots_of(const Scene& scene) {
        std::vector<swarmevo_reference::Body> robots;
        for (const Pose& start : scene.start_poses) robots.push_back({start.x, start.y, start.heading, 0, 0, 0});
        return robots;
    }

    static swarmevo_reference::Body box_of(const Scene& scene) {
        const auto& [x, y, heading] = scene.movables[0].config.pose;
        const auto& [vx, vy, spin] = scene.movables[0].config.velocity;
        return {x, y, heading, vx, vy, spin};
    }

    swarmevo_reference::Parameters parameters_;
    swarmevo_reference::Planar planar_;
};

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
// The reference that the product's physics is held against: robots, what they push, what they run into, in the plane,
// in tiny explicit steps.
//
// It shares no line and no method with the product, so that a mistake of one is not a mistake of both. Contacts are
// springs and dampers, friction is Coulomb's circle, nothing is solved for. It is slow on purpose.
#ifndef SWARMEVO_REFERENCE_PLANAR_HPP
#define SWARMEVO_REFERENCE_PLANAR_HPP

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "shapes.hpp"

namespace swarmevo_reference {

constexpr double kGravity = 9.81;  // m/s^2

struct Parameters {
    double time_step = 1e-5;  // s

    double arena_size = 1.0;  // m, side of the square whose middle is the origin

    double robot_mass = 0.08;            // kg
    double robot_radius = 0.035;         // m
    double axle = 0.053;                 // m, between the wheels' points of contact
    double wheel_radius = 0.0205;        // m
    double wheel_top_speed = 6.28;       // rad/s, at command 1
    double mu_wheel = 1.0;               // 1, wheel on floor
    double mass_height = 0.015;          // m, of the robot's centre of mass, where it is pushed as well
    double caster_offset = 0.03;         // m, from the axle to the frictionless caster
    double load_lag = 2e-4;              // s, with which loads of wheels follow the forces that shift them
    double regularisation_speed = 2e-4;  // m/s, slip below which friction of wheels and sides is viscous

    // Of the one box of a world without a list of movables.
    double box_mass = 0.24;     // kg
    double box_length = 0.275;  // m, along its heading
    double box_width = 0.18;    // m, across its heading
    double mu_box = 0.62;       // 1, feet on floor
    // N/m, of the bristle by which each foot sticks to the floor. Two robots whose blow feet just fail to hold move the
    // box by 2 % more than if feet did not give; with 5e4 by 8 %, as if the blow came when the box already moves.
    double foot_stiffness = 1e6;
    double foot_damping_ratio = 0.7;  // 1, of a movable's vibration on its four bristles, 1 is critical
    double push_height = 0.015;       // m, at which sides push the box; used with shift_loads alone
    bool shift_loads = false;         // whether what pushes a movable's sides shifts load between its feet

    double mu_side = 0.2;            // 1, side on side
    double contact_stiffness = 3e4;  // N/m, of rigid contact
    double restitution = 0.05;       // 1, of rigid contact that could pull; as it cannot, 0.05 gives back up to 0.22
    // 1, of the contact of a movable with what is no robot: so much damping that it does not bounce.
    double movable_damping_ratio = 5;
    bool sprung = true;               // whether robots wear a bumper; if not, all their contacts are rigid
    double bumper_stiffness = 100.0;  // N/m
    double bumper_damping = 4.5;      // N s/m
    double bumper_travel = 0.012;     // m, from the rim at robot_radius inwards to a rigid stop
};

// A number of Parameters by its name, so that other languages need no copy of the struct.
struct Field {
    const char* name;
    double Parameters::*member;
    bool may_be_zero;
};

extern const std::array<Field, 26> kFields;

struct Body {
    double x = 0, y = 0;    // m
    double heading = 0;     // rad, anticlockwise from x
    double vx = 0, vy = 0;  // m/s
    double spin = 0;        // rad/s
};

// What robots push. It stands on four feet of equal load: a box at its corners, a cylinder on its rim at 45 degrees
// from its heading and each 90 on.
struct Movable {
    Figure figure;
    double mass = 0;         // kg
    double friction = 0;     // 1, feet on floor
    double feet = 1;         // 1, where they stand, as a share of the way from the middle to the corners or the rim
    double push_height = 0;  // m, used with shift_loads alone
    Body start;
};

struct Obstacle {
    Figure figure;
    Pose pose;
};

// All but robots.
struct Surroundings {
    std::vector<Movable> movables;
    std::vector<Obstacle> obstacles;
    Arena arena;
};

// Spring, damper and the rigid stop at the end of their travel, of one pair of things that touch.
struct Touch {
    double stiffness = 0;     // N/m
    double damping = 0;       // N s/m
    double travel = 0;        // m
    double stop_damping = 0;  // N s/m
};

class Planar {
  public:
    // In the square arena of the parameters, with the box that they describe; without a box there are robots and walls
    // alone. Throws std::invalid_argument on a parameter out of its range.
    Planar(const Parameters& parameters, const std::vector<Body>& robots, const std::optional<Body>& box);

    Planar(const Parameters& parameters, const std::vector<Body>& robots, const Surroundings& surroundings);

    // Wheel speeds as shares of the top speed, in [-1, 1], held until the next call.
    void set_command(std::size_t robot, double left, double right);

    void advance(long steps);

    std::size_t robots() const { return robots_.size(); }
    std::size_t movables() const { return movables_.size(); }
    const Body& robot(std::size_t i) const { return robots_[i].body; }
    const Body& movable(std::size_t i) const { return movables_[i].body; }
    const Body& box() const { return movable(0); }

    // Sum of the normal forces [N] by which robots push movables: in the last step, and the largest so far.
    double push() const { return push_; }
    double largest_push() const { return largest_push_; }
    void forget_largest_push() { largest_push_ = 0; }

    // Loads [N] of a movable's feet in the last step: rear right, front right, rear left, front left, seen along the
    // heading.
    const std::array<double, 4>& foot_loads(std::size_t movable = 0) const { return movables_[movable].loads; }

    // Kinetic energy of all bodies and elastic energy of the movables' bristles [J].
    double energy() const;

  private:
    struct Mobile {
        Body body;
        double mass = 0, inertia = 0;
        double fx = 0, fy = 0, torque = 0;

        Pose pose() const { return {body.x, body.y, body.heading}; }
    };
    struct Robot : Mobile {
        double left = 0, right = 0;        // rim speeds, m/s
        double forward = 0, sideways = 0;  // lagged friction of both wheels together, N
    };
    struct Foot {
        double along = 0, across = 0;         // m, in the body's frame
        double bristle_x = 0, bristle_y = 0;  // m
    };
    struct Pushed : Mobile {
        Figure figure;
        double friction = 0, push_height = 0;
        double foot_damping = 0;  // N s/m, of each
        std::array<Foot, 4> feet;
        std::array<double, 4> loads{};
        Touch to_robot, to_wall;  // obstacles are walls
    };

    void add(const Movable& movable);
    Touch rigid(double mass) const;
    Touch dead(double mass) const;

    void step();
    void roll(Robot& robot) const;
    void touch_surroundings(Robot& robot) const;
    void touch_movable(Robot& robot, Pushed& movable);
    void touch_robot(Robot& one, Robot& other) const;
    void touch_surroundings(Pushed& movable) const;
    void touch_movables(Pushed& one, Pushed& other) const;
    void rub_feet(Pushed& movable) const;
    double touch(Mobile& one, Mobile* other, const Touch& law, const Contact& contact) const;
    void move(Mobile& mobile) const;

    Parameters p_;
    Arena arena_;
    std::vector<Obstacle> obstacles_;
    Figure rim_;  // of a robot
    std::vector<Robot> robots_;
    std::vector<Pushed> movables_;
    Touch robot_robot_, robot_wall_;
    double push_ = 0, largest_push_ = 0;
};

}  // namespace swarmevo_reference

#endif

// SPDX-License-Identifier: BSD-3-Clause
#include "planar.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace swarmevo_reference {

namespace {

constexpr double kPi = 3.14159265358979323846;

// Signs of the corners along and across the heading, in the order of foot_loads.
constexpr double kAlong[4] = {-1, 1, -1, 1};
constexpr double kAcross[4] = {-1, -1, 1, 1};

// Damping of a linear spring that gives back the share `restitution` of the closing speed (half a period of vibration).
double damping_of(double restitution, double stiffness, double mass) {
    const double log_e = std::log(restitution);
    const double ratio = -log_e / std::sqrt(kPi * kPi + log_e * log_e);
    return 2 * ratio * std::sqrt(stiffness * mass);
}

double reduced(double one, double other) {
    return one * other / (one + other);
}

double norm(double x, double y) {
    return std::sqrt(x * x + y * y);
}

void check(const Parameters& p) {
    for (const Field& field : kFields) {
        const double value = p.*field.member;
        if (!std::isfinite(value) || value < 0 || (value == 0 && !field.may_be_zero))
            throw std::invalid_argument(std::string(field.name) + ": expected a finite number " +
                                        (field.may_be_zero ? "of at least" : "above") + " 0, got " +
                                        std::to_string(value));
    }
    if (p.restitution > 1)
        throw std::invalid_argument("restitution: expected at most 1, got " + std::to_string(p.restitution));
}

void check(const Body& b) {
    for (const double value : {b.x, b.y, b.heading, b.vx, b.vy, b.spin})
        if (!std::isfinite(value)) throw std::invalid_argument("expected finite poses and velocities");
}

}  // namespace

const std::array<Field, 25> kFields = {{
    {"time_step", &Parameters::time_step, false},
    {"arena_size", &Parameters::arena_size, false},
    {"robot_mass", &Parameters::robot_mass, false},
    {"robot_radius", &Parameters::robot_radius, false},
    {"axle", &Parameters::axle, false},
    {"wheel_radius", &Parameters::wheel_radius, false},
    {"wheel_top_speed", &Parameters::wheel_top_speed, false},
    {"mu_wheel", &Parameters::mu_wheel, true},
    {"mass_height", &Parameters::mass_height, true},
    {"caster_offset", &Parameters::caster_offset, false},
    {"load_lag", &Parameters::load_lag, true},
    {"regularisation_speed", &Parameters::regularisation_speed, false},
    {"box_mass", &Parameters::box_mass, false},
    {"box_length", &Parameters::box_length, false},
    {"box_width", &Parameters::box_width, false},
    {"mu_box", &Parameters::mu_box, true},
    {"foot_stiffness", &Parameters::foot_stiffness, false},
    {"foot_damping_ratio", &Parameters::foot_damping_ratio, true},
    {"push_height", &Parameters::push_height, true},
    {"mu_side", &Parameters::mu_side, true},
    {"contact_stiffness", &Parameters::contact_stiffness, false},
    {"restitution", &Parameters::restitution, false},
    {"bumper_stiffness", &Parameters::bumper_stiffness, true},
    {"bumper_damping", &Parameters::bumper_damping, true},
    {"bumper_travel", &Parameters::bumper_travel, true},
}};

Planar::Planar(const Parameters& parameters, const std::vector<Body>& robots, const std::optional<Body>& box)
    : p_(parameters), has_box_(box.has_value()) {
    check(p_);
    for (const Body& body : robots) {
        check(body);
        Robot robot;
        robot.body = body;
        robot.mass = p_.robot_mass;
        robot.inertia = p_.robot_mass * p_.robot_radius * p_.robot_radius / 2;
        robots_.push_back(robot);
    }
    box_.mass = p_.box_mass;
    box_.inertia = p_.box_mass * (p_.box_length * p_.box_length + p_.box_width * p_.box_width) / 12;
    if (box) {
        check(*box);
        box_.body = *box;
    }
    foot_damping_ = 2 * p_.foot_damping_ratio * std::sqrt(4 * p_.foot_stiffness * p_.box_mass) / 4;

    const auto stop = [&](double mass) { return damping_of(p_.restitution, p_.contact_stiffness, mass); };
    robot_robot_.stop_damping = stop(p_.robot_mass / 2);
    robot_box_.stop_damping = stop(reduced(p_.robot_mass, p_.box_mass));
    robot_wall_.stop_damping = stop(p_.robot_mass);
    box_wall_.stop_damping = stop(p_.box_mass);
    if (p_.sprung) {
        const double k = p_.bumper_stiffness, c = p_.bumper_damping, travel = p_.bumper_travel;
        robot_box_ = {k, c, travel, robot_box_.stop_damping};
        robot_wall_ = {k, c, travel, robot_wall_.stop_damping};
        robot_robot_ = {k / 2, c / 2, 2 * travel, robot_robot_.stop_damping};  // two bumpers in series
    }
}

void Planar::set_command(std::size_t robot, double left, double right) {
    const double top = p_.wheel_top_speed * p_.wheel_radius;
    robots_.at(robot).left = left * top;
    robots_.at(robot).right = right * top;
}

void Planar::advance(long steps) {
    for (long i = 0; i < steps; ++i) step();
}

void Planar::step() {
    for (Robot& robot : robots_) robot.fx = robot.fy = robot.torque = 0;
    box_.fx = box_.fy = box_.torque = 0;
    push_ = 0;

    for (std::size_t i = 0; i < robots_.size(); ++i) {
        roll(robots_[i]);
        touch_walls(robots_[i]);
        if (has_box_) touch_box(robots_[i]);
        for (std::size_t j = 0; j < i; ++j) touch_robot(robots_[i], robots_[j]);
    }
    largest_push_ = std::max(largest_push_, push_);
    if (has_box_) {
        touch_corners_to_walls();
        rub_feet();  // last, because loads of feet follow from what the sides push
        move(box_);
    }
    for (Robot& robot : robots_) move(robot);
}

// Friction of both wheels on the floor. The law is viscous below the regularisation speed, so a parked robot that is
// pushed gives way at up to that speed.
void Planar::roll(Robot& r) const {
    const double c = std::cos(r.body.heading), s = std::sin(r.body.heading);
    const double along = c * r.body.vx + s * r.body.vy, across = -s * r.body.vx + c * r.body.vy;

    // Friction acts at the floor, inertia and pushes at mass_height: what is between them tips load.
    const double both =
        std::max(0.0, p_.robot_mass * kGravity - std::abs(r.forward) * p_.mass_height / p_.caster_offset);
    const double shift = std::clamp(r.sideways * p_.mass_height / p_.axle, -both / 2, both / 2);

    double forward = 0, sideways = 0;
    const auto wheel = [&](double offset, double rim_speed, double load) {
        const double slip_along = along - r.body.spin * offset - rim_speed;
        const double viscosity = p_.mu_wheel * load / std::max(norm(slip_along, across), p_.regularisation_speed);
        forward -= viscosity * slip_along;
        sideways -= viscosity * across;
        r.torque += offset * viscosity * slip_along;
    };
    wheel(p_.axle / 2, r.left, both / 2 - shift);
    wheel(-p_.axle / 2, r.right, both / 2 + shift);

    r.fx += c * forward - s * sideways;
    r.fy += s * forward + c * sideways;
    const double share = p_.time_step / (p_.time_step + p_.load_lag);
    r.forward += share * (forward - r.forward);
    r.sideways += share * (sideways - r.sideways);
}

// A bumper that gives way meets the wall at the wall.
void Planar::touch_walls(Robot& r) const {
    const double x = r.body.x, y = r.body.y, radius = p_.robot_radius, end = p_.arena_size / 2;
    touch(r, nullptr, robot_wall_, end, y, -1, 0, x + radius - end);
    touch(r, nullptr, robot_wall_, -end, y, 1, 0, radius - x - end);
    touch(r, nullptr, robot_wall_, x, end, 0, -1, y + radius - end);
    touch(r, nullptr, robot_wall_, x, -end, 0, 1, radius - y - end);
}

void Planar::touch_box(Robot& r) {
    const double from_box_x = r.body.x - box_.body.x, from_box_y = r.body.y - box_.body.y;
    const double half_length = p_.box_length / 2, half_width = p_.box_width / 2;
    const double reach = p_.robot_radius + half_length + half_width;
    if (from_box_x * from_box_x + from_box_y * from_box_y > reach * reach) return;

    const double c = std::cos(box_.body.heading), s = std::sin(box_.body.heading);
    const double along = c * from_box_x + s * from_box_y, across = -s * from_box_x + c * from_box_y;
    double near_along = std::clamp(along, -half_length, half_length);
    double near_across = std::clamp(across, -half_width, half_width);
    double n_along = along - near_along, n_across = across - near_across;
    double gap = norm(n_along, n_across);
    if (gap > 0) {
        n_along /= gap;
        n_across /= gap;
    } else {  // the robot's middle is inside: out by the nearest side
        const double to_end = half_length - std::abs(along), to_side = half_width - std::abs(across);
        gap = -std::min(to_end, to_side);
        n_along = to_end < to_side ? std::copysign(1, along) : 0;
        n_across = to_end < to_side ? 0 : std::copysign(1, across);
        near_along -= gap * n_along;
        near_across -= gap * n_across;
    }
    push_ += touch(r, &box_, robot_box_, box_.body.x + c * near_along - s * near_across,
                   box_.body.y + s * near_along + c * near_across, c * n_along - s * n_across,
                   s * n_along + c * n_across, p_.robot_radius - gap);
}

void Planar::touch_robot(Robot& one, Robot& other) const {
    const double dx = one.body.x - other.body.x, dy = one.body.y - other.body.y;
    const double squared = dx * dx + dy * dy, reach = 2 * p_.robot_radius;
    if (squared >= reach * reach || squared == 0) return;  // two in one place have no direction to part in
    const double distance = std::sqrt(squared);
    touch(one, &other, robot_robot_, (one.body.x + other.body.x) / 2, (one.body.y + other.body.y) / 2, dx / distance,
          dy / distance, reach - distance);
}

void Planar::touch_corners_to_walls() {
    const double c = std::cos(box_.body.heading), s = std::sin(box_.body.heading), end = p_.arena_size / 2;
    for (int i = 0; i < 4; ++i) {
        const double along = kAlong[i] * p_.box_length / 2, across = kAcross[i] * p_.box_width / 2;
        const double x = box_.body.x + c * along - s * across, y = box_.body.y + s * along + c * across;
        touch(box_, nullptr, box_wall_, x, y, -1, 0, x - end);
        touch(box_, nullptr, box_wall_, x, y, 1, 0, -x - end);
        touch(box_, nullptr, box_wall_, x, y, 0, -1, y - end);
        touch(box_, nullptr, box_wall_, x, y, 0, 1, -y - end);
    }
}

// Forces of one contact at (x, y), whose normal points to `one`; nullptr is a wall. Returns the normal force.
double Planar::touch(Mobile& one, Mobile* other, const Touch& law, double x, double y, double nx, double ny,
                     double depth) const {
    if (depth <= 0) return 0;
    const double tx = -ny, ty = nx;
    double vx = 0, vy = 0, mobility = 0;  // of `one` against `other`; 1/kg, of the contact along the tangent
    const auto add = [&](const Mobile& m, double sign) {
        const double ax = x - m.body.x, ay = y - m.body.y, arm = ax * ty - ay * tx;
        vx += sign * (m.body.vx - m.body.spin * ay);
        vy += sign * (m.body.vy + m.body.spin * ax);
        mobility += 1 / m.mass + arm * arm / m.inertia;
    };
    add(one, 1);
    if (other) add(*other, -1);

    const double closing = -(vx * nx + vy * ny), slip = vx * tx + vy * ty;
    double normal = std::max(0.0, law.stiffness * depth + law.damping * closing);
    if (depth > law.travel)
        normal += std::max(0.0, p_.contact_stiffness * (depth - law.travel) + law.stop_damping * closing);

    // In a blow the regularised law is too steep for the step, so one step takes at most half of the slip away.
    const double viscosity = std::min(p_.mu_side * normal / std::max(std::abs(slip), p_.regularisation_speed),
                                      0.5 / (mobility * p_.time_step));
    const double fx = normal * nx - viscosity * slip * tx, fy = normal * ny - viscosity * slip * ty;
    const auto apply = [&](Mobile& m, double sign) {
        m.fx += sign * fx;
        m.fy += sign * fy;
        m.torque += sign * ((x - m.body.x) * fy - (y - m.body.y) * fx);
    };
    apply(one, 1);
    if (other) apply(*other, -1);
    return normal;
}

// Each foot hangs on the floor by a bristle that is dragged along once its force is the limit: it stands without creep,
// and slides by Coulomb's circle.
void Planar::rub_feet() {
    const double c = std::cos(box_.body.heading), s = std::sin(box_.body.heading);
    const double weight = p_.box_mass * kGravity;
    // Statics: pushes at push_height and friction at the floor are a couple, which loads the feet that lie ahead of the
    // push. A box that speeds up is taken to be as loaded as one that stands.
    const double tip_along = p_.shift_loads ? (c * box_.fx + s * box_.fy) * p_.push_height / p_.box_length : 0;
    const double tip_across = p_.shift_loads ? (-s * box_.fx + c * box_.fy) * p_.push_height / p_.box_width : 0;
    double total = 0;
    for (int i = 0; i < 4; ++i) {
        foot_loads_[i] = std::max(0.0, weight / 4 + (kAlong[i] * tip_along + kAcross[i] * tip_across) / 2);
        total += foot_loads_[i];
    }
    for (double& load : foot_loads_) load *= weight / total;  // changes something only where a foot has lifted

    for (int i = 0; i < 4; ++i) {
        const double along = kAlong[i] * p_.box_length / 2, across = kAcross[i] * p_.box_width / 2;
        const double ax = c * along - s * across, ay = s * along + c * across;
        const double vx = box_.body.vx - box_.body.spin * ay, vy = box_.body.vy + box_.body.spin * ax;
        const double limit = p_.mu_box * foot_loads_[i];
        Bristle& bristle = bristles_[i];
        bristle.x += vx * p_.time_step;
        bristle.y += vy * p_.time_step;
        const double longest = limit / p_.foot_stiffness, length = norm(bristle.x, bristle.y);
        if (length > longest) {
            bristle.x *= longest / length;
            bristle.y *= longest / length;
        }
        double fx = -p_.foot_stiffness * bristle.x - foot_damping_ * vx;
        double fy = -p_.foot_stiffness * bristle.y - foot_damping_ * vy;
        const double force = norm(fx, fy);
        if (force > limit) {
            fx *= limit / force;
            fy *= limit / force;
        }
        box_.fx += fx;
        box_.fy += fy;
        box_.torque += ax * fy - ay * fx;
    }
}

// Symplectic Euler: the new speed moves the body.
void Planar::move(Mobile& m) const {
    const double dt = p_.time_step;
    m.body.vx += dt * m.fx / m.mass;
    m.body.vy += dt * m.fy / m.mass;
    m.body.spin += dt * m.torque / m.inertia;
    m.body.x += dt * m.body.vx;
    m.body.y += dt * m.body.vy;
    m.body.heading += dt * m.body.spin;
}

double Planar::energy() const {
    const auto kinetic = [](const Mobile& m) {
        return (m.mass * (m.body.vx * m.body.vx + m.body.vy * m.body.vy) + m.inertia * m.body.spin * m.body.spin) / 2;
    };
    double sum = 0;
    for (const Robot& robot : robots_) sum += kinetic(robot);
    if (!has_box_) return sum;
    for (const Bristle& b : bristles_) sum += p_.foot_stiffness * (b.x * b.x + b.y * b.y) / 2;
    return sum + kinetic(box_);
}

}  // namespace swarmevo_reference

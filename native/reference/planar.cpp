// SPDX-License-Identifier: BSD-3-Clause
#include "planar.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <stdexcept>
#include <string>

namespace swarmevo_reference {

namespace {

constexpr double kPi = 3.14159265358979323846;

// Signs of the feet along and across the heading, in the order of foot_loads.
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

void check(std::initializer_list<double> place) {
    for (const double value : place)
        if (!std::isfinite(value)) throw std::invalid_argument("expected finite poses and velocities");
}

void check(const Body& b) {
    check({b.x, b.y, b.heading, b.vx, b.vy, b.spin});
}

void check(const Figure& figure) {
    if (!(figure.length > 0) || !(figure.width > 0) || (figure.is_round && figure.length != figure.width))
        throw std::invalid_argument("expected a size above 0, of a disc its diameter twice, got " +
                                    std::to_string(figure.length) + " by " + std::to_string(figure.width));
}

void check(const Movable& m) {
    check(m.figure);
    check(m.start);
    if (!(m.mass > 0) || !(m.friction >= 0) || !(m.feet > 0) || !(m.push_height >= 0))
        throw std::invalid_argument("movable: expected mass and feet above 0, friction and push_height of at least 0");
}

Surroundings surroundings_of(const Parameters& p, const std::optional<Body>& box) {
    check(p);
    Surroundings all;
    all.arena = Arena::square(p.arena_size);
    if (box) all.movables.push_back({{false, p.box_length, p.box_width}, p.box_mass, p.mu_box, 1, p.push_height, *box});
    return all;
}

}  // namespace

const std::array<Field, 26> kFields = {{
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
    {"movable_damping_ratio", &Parameters::movable_damping_ratio, true},
    {"bumper_stiffness", &Parameters::bumper_stiffness, true},
    {"bumper_damping", &Parameters::bumper_damping, true},
    {"bumper_travel", &Parameters::bumper_travel, true},
}};

Planar::Planar(const Parameters& parameters, const std::vector<Body>& robots, const std::optional<Body>& box)
    : Planar(parameters, robots, surroundings_of(parameters, box)) {}

Planar::Planar(const Parameters& parameters, const std::vector<Body>& robots, const Surroundings& surroundings)
    : p_(parameters),
      arena_(surroundings.arena),
      obstacles_(surroundings.obstacles),
      rim_{true, 2 * parameters.robot_radius, 2 * parameters.robot_radius} {
    check(p_);
    for (const Obstacle& obstacle : obstacles_) {
        check(obstacle.figure);
        check({obstacle.pose.x, obstacle.pose.y, obstacle.pose.heading});
    }
    for (const Body& body : robots) {
        check(body);
        Robot robot;
        robot.body = body;
        robot.mass = p_.robot_mass;
        robot.inertia = p_.robot_mass * p_.robot_radius * p_.robot_radius / 2;
        robots_.push_back(robot);
    }
    for (const Movable& movable : surroundings.movables) add(movable);

    robot_robot_ = rigid(p_.robot_mass / 2);
    robot_wall_ = rigid(p_.robot_mass);
    if (p_.sprung) {
        const double k = p_.bumper_stiffness, c = p_.bumper_damping, travel = p_.bumper_travel;
        robot_wall_ = {k, c, travel, robot_wall_.stop_damping};
        robot_robot_ = {k / 2, c / 2, 2 * travel, robot_robot_.stop_damping};  // two bumpers in series
    }
}

void Planar::add(const Movable& movable) {
    check(movable);
    const Figure& figure = movable.figure;
    Pushed pushed;
    pushed.body = movable.start;
    pushed.figure = figure;
    pushed.friction = movable.friction;
    pushed.push_height = movable.push_height;
    pushed.mass = movable.mass;
    // Solid, of even density.
    pushed.inertia = figure.is_round
                         ? movable.mass * figure.length * figure.length / 8
                         : movable.mass * (figure.length * figure.length + figure.width * figure.width) / 12;
    const double share = movable.feet * (figure.is_round ? std::sqrt(0.5) : 1);
    for (int i = 0; i < 4; ++i) {
        pushed.feet[i].along = kAlong[i] * share * figure.length / 2;
        pushed.feet[i].across = kAcross[i] * share * figure.width / 2;
    }
    pushed.foot_damping = 2 * p_.foot_damping_ratio * std::sqrt(4 * p_.foot_stiffness * movable.mass) / 4;
    pushed.to_wall = dead(movable.mass);
    pushed.to_robot = rigid(reduced(movable.mass, p_.robot_mass));
    if (p_.sprung)
        pushed.to_robot = {p_.bumper_stiffness, p_.bumper_damping, p_.bumper_travel, pushed.to_robot.stop_damping};
    movables_.push_back(pushed);
}

// Of a pair of which a robot is one, by their reduced mass.
Touch Planar::rigid(double mass) const {
    return {0, 0, 0, damping_of(p_.restitution, p_.contact_stiffness, mass)};
}

// Of a pair without a robot: a blow gives nothing back.
Touch Planar::dead(double mass) const {
    return {0, 0, 0, 2 * p_.movable_damping_ratio * std::sqrt(p_.contact_stiffness * mass)};
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
    for (Pushed& movable : movables_) movable.fx = movable.fy = movable.torque = 0;
    push_ = 0;

    for (std::size_t i = 0; i < robots_.size(); ++i) {
        roll(robots_[i]);
        touch_surroundings(robots_[i]);
        for (Pushed& movable : movables_) touch_movable(robots_[i], movable);
        for (std::size_t j = 0; j < i; ++j) touch_robot(robots_[i], robots_[j]);
    }
    largest_push_ = std::max(largest_push_, push_);
    for (std::size_t i = 0; i < movables_.size(); ++i) {
        touch_surroundings(movables_[i]);
        for (std::size_t j = 0; j < i; ++j) touch_movables(movables_[i], movables_[j]);
    }
    for (Pushed& movable : movables_) {
        rub_feet(movable);  // last, because loads of feet follow from what the sides push
        move(movable);
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
void Planar::touch_surroundings(Robot& r) const {
    for (const Contact& contact : beyond_walls(rim_, r.pose(), arena_)) touch(r, nullptr, robot_wall_, contact);
    for (const Obstacle& obstacle : obstacles_)
        for (const Contact& contact : overlap(rim_, r.pose(), obstacle.figure, obstacle.pose))
            touch(r, nullptr, robot_wall_, contact);
}

void Planar::touch_movable(Robot& r, Pushed& m) {
    for (const Contact& contact : overlap(rim_, r.pose(), m.figure, m.pose()))
        push_ += touch(r, &m, m.to_robot, contact);
}

void Planar::touch_robot(Robot& one, Robot& other) const {
    for (Contact contact : overlap(rim_, one.pose(), rim_, other.pose())) {
        contact.x = (one.body.x + other.body.x) / 2;
        contact.y = (one.body.y + other.body.y) / 2;
        touch(one, &other, robot_robot_, contact);
    }
}

void Planar::touch_surroundings(Pushed& m) const {
    for (const Contact& contact : beyond_walls(m.figure, m.pose(), arena_)) touch(m, nullptr, m.to_wall, contact);
    for (const Obstacle& obstacle : obstacles_)
        for (const Contact& contact : overlap(m.figure, m.pose(), obstacle.figure, obstacle.pose))
            touch(m, nullptr, m.to_wall, contact);
}

void Planar::touch_movables(Pushed& one, Pushed& other) const {
    for (const Contact& contact : overlap(one.figure, one.pose(), other.figure, other.pose()))
        touch(one, &other, dead(reduced(one.mass, other.mass)), contact);
}

// Forces of one contact, whose normal points to `one`; nullptr is what stands still. Returns the normal force.
double Planar::touch(Mobile& one, Mobile* other, const Touch& law, const Contact& contact) const {
    const double nx = contact.nx, ny = contact.ny, depth = contact.depth;
    const double tx = -ny, ty = nx;
    double vx = 0, vy = 0, mobility = 0;  // of `one` against `other`; 1/kg, of the contact along the tangent
    const auto add = [&, x = contact.x, y = contact.y](const Mobile& m, double sign) {
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
    const auto apply = [&, x = contact.x, y = contact.y](Mobile& m, double sign) {
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
void Planar::rub_feet(Pushed& m) const {
    const double c = std::cos(m.body.heading), s = std::sin(m.body.heading);
    const double weight = m.mass * kGravity;
    // Statics: pushes at push_height and friction at the floor are a couple, which loads the feet that lie ahead of the
    // push. A movable that speeds up is taken to be as loaded as one that stands.
    const double tip_along = p_.shift_loads ? (c * m.fx + s * m.fy) * m.push_height : 0;
    const double tip_across = p_.shift_loads ? (-s * m.fx + c * m.fy) * m.push_height : 0;
    double total = 0;
    for (int i = 0; i < 4; ++i) {
        m.loads[i] = std::max(0.0, weight / 4 + (tip_along / m.feet[i].along + tip_across / m.feet[i].across) / 4);
        total += m.loads[i];
    }
    for (double& load : m.loads) load *= weight / total;  // changes something only where a foot has lifted

    for (int i = 0; i < 4; ++i) {
        Foot& foot = m.feet[i];
        const double ax = c * foot.along - s * foot.across, ay = s * foot.along + c * foot.across;
        const double vx = m.body.vx - m.body.spin * ay, vy = m.body.vy + m.body.spin * ax;
        const double limit = m.friction * m.loads[i];
        foot.bristle_x += vx * p_.time_step;
        foot.bristle_y += vy * p_.time_step;
        const double longest = limit / p_.foot_stiffness, length = norm(foot.bristle_x, foot.bristle_y);
        if (length > longest) {
            foot.bristle_x *= longest / length;
            foot.bristle_y *= longest / length;
        }
        double fx = -p_.foot_stiffness * foot.bristle_x - m.foot_damping * vx;
        double fy = -p_.foot_stiffness * foot.bristle_y - m.foot_damping * vy;
        const double force = norm(fx, fy);
        if (force > limit) {
            fx *= limit / force;
            fy *= limit / force;
        }
        m.fx += fx;
        m.fy += fy;
        m.torque += ax * fy - ay * fx;
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
    for (const Pushed& m : movables_) {
        for (const Foot& foot : m.feet)
            sum += p_.foot_stiffness * (foot.bristle_x * foot.bristle_x + foot.bristle_y * foot.bristle_y) / 2;
        sum += kinetic(m);
    }
    return sum;
}

}  // namespace swarmevo_reference

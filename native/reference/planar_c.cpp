// SPDX-License-Identifier: BSD-3-Clause
// The reference for other languages. Bodies are six numbers each: x, y [m], heading [rad], vx, vy [m/s], spin [rad/s].
#include <algorithm>
#include <cstring>
#include <exception>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "planar.hpp"

using swarmevo_reference::Body;
using swarmevo_reference::kFields;
using swarmevo_reference::Parameters;
using swarmevo_reference::Planar;

namespace {

Body read(const double* six) {
    return {six[0], six[1], six[2], six[3], six[4], six[5]};
}

double* write(const Body& body, double* six) {
    const double values[6] = {body.x, body.y, body.heading, body.vx, body.vy, body.spin};
    return std::copy(values, values + 6, six);
}

void set(Parameters& parameters, const std::string& name, double value) {
    if (name == "sprung" || name == "shift_loads") {
        (name == "sprung" ? parameters.sprung : parameters.shift_loads) = value != 0;
        return;
    }
    for (const auto& field : kFields)
        if (name == field.name) {
            parameters.*field.member = value;
            return;
        }
    throw std::invalid_argument(name + ": no such parameter, see struct Parameters in planar.hpp");
}

}  // namespace

extern "C" {

// `box` is six numbers or null for a world without a box. On failure returns null and writes one line to `message`,
// which has room for `room` characters.
Planar* planar_create(const char* const* names, const double* values, int parameters, const double* robots, int n,
                      const double* box, char* message, int room) {
    try {
        Parameters all;
        for (int i = 0; i < parameters; ++i) set(all, names[i], values[i]);
        std::vector<Body> bodies;
        for (int i = 0; i < n; ++i) bodies.push_back(read(robots + 6 * i));
        return new Planar(all, bodies, box ? std::optional<Body>(read(box)) : std::nullopt);
    } catch (const std::exception& error) {
        std::strncpy(message, error.what(), static_cast<std::size_t>(room - 1));
        message[room - 1] = '\0';
        return nullptr;
    }
}

void planar_destroy(Planar* world) {
    delete world;
}

// Left and right of each robot, in [-1, 1].
void planar_set_commands(Planar* world, const double* commands) {
    for (std::size_t i = 0; i < world->robots(); ++i) world->set_command(i, commands[2 * i], commands[2 * i + 1]);
}

void planar_advance(Planar* world, long steps) {
    world->advance(steps);
}

// Six numbers of each robot, then of the box if there is one.
void planar_read_state(const Planar* world, double* state) {
    for (std::size_t i = 0; i < world->robots(); ++i) state = write(world->robot(i), state);
    if (world->has_box()) write(world->box(), state);
}

// N, rear right, front right, rear left, front left, seen along the heading.
void planar_read_foot_loads(const Planar* world, double* four) {
    std::copy(world->foot_loads().begin(), world->foot_loads().end(), four);
}

double planar_push(const Planar* world) {
    return world->push();
}

double planar_largest_push(const Planar* world) {
    return world->largest_push();
}

void planar_forget_largest_push(Planar* world) {
    world->forget_largest_push();
}

double planar_energy(const Planar* world) {
    return world->energy();
}

double planar_default_time_step() {
    return Parameters{}.time_step;
}

}  // extern "C"

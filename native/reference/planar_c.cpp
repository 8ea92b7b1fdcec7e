// SPDX-License-Identifier: BSD-3-Clause
// The reference for other languages. Bodies are six numbers each: x, y [m], heading [rad], vx, vy [m/s], spin [rad/s].
// A movable is thirteen: 1 if it is round, else 0; length, width [m]; mass [kg]; friction, feet [1]; push_height [m];
// its body. An obstacle is six: 1 if it is round; length, width; x, y, heading.
#include <algorithm>
#include <cstring>
#include <exception>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "planar.hpp"

using namespace swarmevo_reference;

namespace {

Body read(const double* six) {
    return {six[0], six[1], six[2], six[3], six[4], six[5]};
}

double* write(const Body& body, double* six) {
    const double values[6] = {body.x, body.y, body.heading, body.vx, body.vy, body.spin};
    return std::copy(values, values + 6, six);
}

std::vector<Body> read(const double* bodies, int n) {
    std::vector<Body> all;
    for (int i = 0; i < n; ++i) all.push_back(read(bodies + 6 * i));
    return all;
}

Surroundings read(const double* movables, int n_movables, const double* obstacles, int n_obstacles, const double* arena,
                  int corners) {
    Surroundings all;
    for (const double* m = movables; m != movables + 13 * n_movables; m += 13)
        all.movables.push_back({{m[0] != 0, m[1], m[2]}, m[3], m[4], m[5], m[6], read(m + 7)});
    for (const double* o = obstacles; o != obstacles + 6 * n_obstacles; o += 6)
        all.obstacles.push_back({{o[0] != 0, o[1], o[2]}, {o[3], o[4], o[5]}});
    std::vector<Point> points;
    for (int i = 0; i < corners; ++i) points.push_back({arena[2 * i], arena[2 * i + 1]});
    all.arena = corners > 0 ? Arena::polygon(points) : Arena::round(*arena);
    return all;
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

Parameters read(const char* const* names, const double* values, int n) {
    Parameters all;
    for (int i = 0; i < n; ++i) set(all, names[i], values[i]);
    return all;
}

template <typename Make>
Planar* created(char* message, int room, Make make) {
    try {
        return make();
    } catch (const std::exception& error) {
        std::strncpy(message, error.what(), static_cast<std::size_t>(room - 1));
        message[room - 1] = '\0';
        return nullptr;
    }
}

}  // namespace

extern "C" {

// All creators return null on failure, and write one line to `message`, which has room for `room` characters.

// `box` is six numbers or null for a world without a box.
Planar* planar_create(const char* const* names, const double* values, int parameters, const double* robots, int n,
                      const double* box, char* message, int room) {
    return created(message, room, [&] {
        return new Planar(read(names, values, parameters), read(robots, n),
                          box ? std::optional<Body>(read(box)) : std::nullopt);
    });
}

// `arena` is x, y of each corner, anticlockwise, or, with 0 corners, the radius of a round one.
Planar* planar_create_among(const char* const* names, const double* values, int parameters, const double* robots, int n,
                            const double* movables, int n_movables, const double* obstacles, int n_obstacles,
                            const double* arena, int corners, char* message, int room) {
    return created(message, room, [&] {
        return new Planar(read(names, values, parameters), read(robots, n),
                          read(movables, n_movables, obstacles, n_obstacles, arena, corners));
    });
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

// Six numbers of each robot, then of each movable.
void planar_read_state(const Planar* world, double* state) {
    for (std::size_t i = 0; i < world->robots(); ++i) state = write(world->robot(i), state);
    for (std::size_t i = 0; i < world->movables(); ++i) state = write(world->movable(i), state);
}

// N, rear right, front right, rear left, front left, seen along the heading.
void planar_read_foot_loads(const Planar* world, int movable, double* four) {
    const auto& loads = world->foot_loads(static_cast<std::size_t>(movable));
    std::copy(loads.begin(), loads.end(), four);
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

// SPDX-License-Identifier: BSD-3-Clause
// Cubes with contacts of ODE, for the tests of both.
#pragma once

#include <vector>

#include "fixture.hpp"
#include "world/contacts.hpp"

namespace swarmevo::cubes {

inline constexpr double kStep = 0.01, kMass = 0.1, kSide = 0.1, kGravity = 9.81, kErp = 0.2;
inline constexpr Vector kUp = {0, 0, 1}, kEast = {1, 0, 0};
inline constexpr Friction kSmooth = {kEast, 0, 0, 0};

inline swe_physics_config physics() {
    return Fixture().config.physics;
}

// A world with our settings of contacts and `n` cubes in a row, a metre apart, that touch each other nowhere.
struct Cubes {
    const swe_physics_config settings = physics();
    OdeWorld world;
    Contacts contacts{world, settings};
    std::vector<dBodyID> bodies;

    explicit Cubes(int n = 1, double gravity = 0) {
        dWorldSetGravity(world.id(), 0, 0, -gravity);
        dWorldSetERP(world.id(), kErp);
        dWorldSetCFM(world.id(), settings.contact_cfm);
        dMass mass;
        dMassSetBoxTotal(&mass, kMass, kSide, kSide, kSide);
        for (int i = 0; i < n; ++i) bodies.push_back(create_body(world.id(), {1.0 * i, 0, kSide / 2}, 0, 0, mass));
    }

    // A contact of a body with the floor at the body's centre, so that friction turns nothing.
    void touch_floor(dBodyID body, double gap, const Friction& friction) {
        const dReal* p = dBodyGetPosition(body);
        contacts.add(body, nullptr, {p[0], p[1], p[2]}, kUp, gap, friction);
    }
    void stand(dBodyID body, const Friction& friction) {
        touch_floor(body, dBodyGetPosition(body)[2] - kSide / 2, friction);
    }

    // Slides, rubs and falls for a while. All bits of where that leads.
    std::vector<double> tumble(int steps) {
        std::vector<double> bits;
        for (int i = 0; i < steps; ++i) {
            contacts.begin(kStep, false);
            for (const dBodyID body : bodies) {
                stand(body, {kEast, 0.5, 0.3, 0.1});
                dBodyAddTorque(body, 1e-4, 2e-4, 1e-4);
            }
            world.step(kStep);
        }
        for (const dBodyID body : bodies) {
            const BodyState state = state_of(body);
            bits.insert(bits.end(), state.position, state.position + 3);
            bits.insert(bits.end(), state.quaternion, state.quaternion + 4);
            bits.insert(bits.end(), state.velocity, state.velocity + 3);
            bits.insert(bits.end(), state.spin, state.spin + 3);
        }
        return bits;
    }
};

}  // namespace swarmevo::cubes

// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "fixture.hpp"
#include "rng.hpp"
#include "world_box.hpp"

using namespace swarmevo;

namespace {

constexpr double kStep = 0.05;

// The paper's box alone, with what pushes it given as numbers.
struct LoneBox {
    const Scene scene;
    OdeWorld world;
    Contacts contacts{world, scene.physics};
    Box box{scene, world.id()};
    const double grip = scene.physics.box_friction * scene.box.mass * scene.physics.gravity;  // of all corners [N]

    explicit LoneBox(double x = 0, double y = 0, double heading = 0)
        : scene(Fixture({0.45, -0.45, 0}).without_noise().box_at(x, y, heading).scene()) {
        dWorldSetCFM(world.id(), scene.physics.contact_cfm);
        dWorldSetERP(world.id(), scene.physics.contact_erp);
    }

    void move(double vx, double vy, double spin) {
        dBodySetLinearVel(box.body(), vx, vy, 0);
        dBodySetAngularVel(box.body(), 0, 0, spin);
    }

    // Fastest of its points [m/s].
    double speed() const {
        const dReal* v = dBodyGetLinearVel(box.body());
        return std::hypot(v[0], v[1]) + std::abs(dBodyGetAngularVel(box.body())[2]) * box.reach();
    }

    bool holds(const Box::Load& load) {
        box.assume(true);
        const bool stood = box.moved_as_assumed(load);
        box.finish();
        return stood;
    }

    void distrust() {
        box.assume(true);
        const bool stood = box.moved_as_assumed({1e6, 1e6, 1e6});
        REQUIRE_FALSE(stood);
    }

    // A step under a load. Was it as assumed?
    bool step(const Box::Load& load, bool is_still) {
        contacts.begin(kStep, false);
        box.assume(is_still);
        box.add_floor_contacts(contacts);
        dBodyAddForce(box.body(), load.x, load.y, 0);
        dBodyAddTorque(box.body(), 0, 0, load.torque);
        REQUIRE(world.step(kStep) == 0);
        const bool as_assumed = box.moved_as_assumed(load);
        box.finish();
        return as_assumed;
    }
};

// Uniform numbers in [-1, 1).
struct Random {
    std::uint32_t count = 0;
    double operator()() { return symmetric(draw({1, 0, 0, 0}, Purpose::start, 0, count++)[0]); }
};

}  // namespace

TEST_CASE("floor holds a standing box just as long as the solver's friction does") {
    Random random;
    for (int i = 0; i < 300; ++i) {
        const double heading = kPi * random();
        LoneBox tried(0, 0, heading);
        const double half_x = tried.scene.box.size[0] / 2, half_y = tried.scene.box.size[1] / 2;
        const double along_x = random(), along_y = random(), torque = 0.2 * random();
        // Where friction gives way: along an edge, or with what that leaves at the levers of both edges.
        const double most = tried.grip * std::min({1 / std::abs(along_x), 1 / std::abs(along_y),
                                                   (half_x + half_y) / (std::abs(torque) + half_x * std::abs(along_y) +
                                                                        half_y * std::abs(along_x))});
        for (const double part : {0.99, 1.01}) {
            const double x = part * most * along_x, y = part * most * along_y;
            const Box::Load load{std::cos(heading) * x - std::sin(heading) * y,
                                 std::sin(heading) * x + std::cos(heading) * y, part * most * torque};
            LoneBox box(0, 0, heading);
            CHECK(box.holds(load) == (part < 1));
            box.distrust();
            box.step(load, true);
            CHECK((box.speed() < 1e-4) == (part < 1));
        }
    }
}

TEST_CASE("a wall holds a box against what presses on it, between the corners that touch it") {
    const double half_x = LoneBox().scene.box.size[0] / 2, half_y = LoneBox().scene.box.size[1] / 2;
    LoneBox flat(0, 0.5 - half_y);
    CHECK(flat.holds({0, 1000, 0}));
    CHECK(flat.holds({0, 1000, 999 * half_x}));
    CHECK_FALSE(flat.holds({0, 1000, 1010 * half_x}));
    CHECK_FALSE(flat.holds({0, -1000, 0}));
    CHECK_FALSE(flat.holds({1000, 1000, 0}));
    CHECK(LoneBox(0.5 - half_x, 0.5 - half_y).holds({1000, 1000, 0}));
    CHECK(LoneBox(half_x - 0.5, half_y - 0.5).holds({-1000, -1000, 0}));
    CHECK_FALSE(LoneBox(0, 0.5 - half_y - 1e-4).holds({0, 1000, 0}));

    // A corner alone is a pivot.
    const double turned = kPi / 4, reach = (half_x + half_y) * std::sqrt(0.5);
    LoneBox edge(0, 0.5 - reach, turned);
    const double lever = (half_x - half_y) * std::sqrt(0.5);  // the corner's, to the east of the middle
    CHECK(edge.holds({0, 1000, 1000 * lever}));
    CHECK_FALSE(edge.holds({0, 1000, 0}));
}

TEST_CASE("a box that slides moves as if its friction were solved for") {
    Random random;
    int assumed = 0;
    for (int i = 0; i < 300; ++i) {
        const double heading = kPi * random(), vx = random(), vy = random(), spin = 0.5 * random();
        const Box::Load load{random(), random(), 0.05 * random()};
        LoneBox box(0, 0, heading), reference(0, 0, heading);
        box.move(vx, vy, spin);
        if (!box.step(load, false)) continue;
        ++assumed;
        reference.distrust();
        reference.move(vx, vy, spin);
        reference.step(load, false);
        const BodyState got = state_of(box.box.body()), expected = state_of(reference.box.body());
        for (int k = 0; k < 3; ++k) {
            CHECK(got.velocity[k] == doctest::Approx(expected.velocity[k]).epsilon(1e-4).scale(0.1));
            CHECK(got.spin[k] == doctest::Approx(expected.spin[k]).epsilon(1e-4).scale(1));
        }
    }
    CHECK(assumed > 50);
}

TEST_CASE("a box that is about to stop or to turn is not assumed to slide on") {
    LoneBox stopping, turning;
    stopping.move(0.1, 0, 0);  // friction takes 0.28 m/s in a step
    CHECK_FALSE(stopping.step({0, 0, 0}, false));
    turning.move(1, 0, 0);
    CHECK_FALSE(turning.step({0, 0, 10}, false));
}

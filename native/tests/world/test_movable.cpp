// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "fixture.hpp"
#include "planar_twin.hpp"
#include "rng.hpp"
#include "world/compliant.hpp"
#include "world/constants.hpp"
#include "world/movable.hpp"

using namespace swarmevo;

namespace {

constexpr double kStep = 0.05;
constexpr double kForceError = 1e-6;  // [N]
constexpr int kManyTries = 200;       // World has kMostTries, and then shorter steps

// The paper's box alone, with what pushes it given as numbers.
struct LoneBox {
    const Scene scene;
    OdeWorld world;
    Contacts contacts{world, scene.physics};
    Movable box{scene, scene.movables[0], world.id(), starts_of(scene).movables[0]};
    const double limit =  // of friction at a corner [N]
        scene.movables[0].config.friction * scene.movables[0].config.mass * scene.physics.gravity / Movable::kCorners;

    explicit LoneBox(double x = 0, double y = 0, double heading = 0)
        : scene(Fixture({0.45, -0.45, 0}).without_noise().box_at(x, y, heading).scene()) {
        dWorldSetCFM(world.id(), scene.physics.contact_cfm);
        dWorldSetERP(world.id(), scene.physics.contact_erp);
    }

    Place place() const {
        const Pose pose = pose_of(box.body());
        return {pose.x, pose.y, std::cos(pose.heading), std::sin(pose.heading)};
    }

    // Fastest of its points [m/s].
    double speed() const {
        const dReal* v = dBodyGetLinearVel(box.body());
        return std::hypot(v[0], v[1]) + std::abs(dBodyGetAngularVel(box.body())[2]) * box.figure().reach;
    }

    bool holds(const Load& load) {
        box.expect();
        box.assume_standing(true);
        box.place_at(place());
        return box.withstands(load);
    }

    // A step under a load, laid out anew until it fits. The load comes as what it adds to the velocity. Returns whether
    // ODE was used: where it is not asked for, it is the way out as in World.
    bool step(const Load& load, bool is_still, bool by_ode) {
        dMass mass;
        dBodyGetMass(box.body(), &mass);
        const dReal* v = dBodyGetLinearVel(box.body());
        dBodySetLinearVel(box.body(), v[0] + load.x * kStep / mass.mass, v[1] + load.y * kStep / mass.mass, 0);
        const double spin = dBodyGetAngularVel(box.body())[2];
        dBodySetAngularVel(box.body(), 0, 0, spin + load.torque * kStep / mass.I[10]);
        const BodyState before = state_of(box.body());
        box.expect();
        box.assume_standing(is_still);
        for (int tries = 0; tries < kManyTries; ++tries) {
            set_state(box.body(), before);
            box.place_at(place());
            if (!box.stands()) by_ode = !move(by_ode);
            if (box.stands() ? !box.withstands(load) : by_ode && !box.fits()) continue;
            box.finish(by_ode);
            return by_ode;
        }
        FAIL("the step never fitted");
        return by_ode;
    }

    // Returns whether all that gives way was solved for.
    bool move(bool by_ode) {
        contacts.begin(kStep, false);
        CompliantStep compliant(contacts, kForceError);
        compliant.begin(kStep);
        compliant.add_body(0, box.body(), place(), nullptr);
        if (!by_ode) {
            box.add_to(compliant);
            if (compliant.solve()) return true;
            contacts.begin(kStep, false);
        }
        box.add_to(contacts);
        REQUIRE(world.step(kStep) == 0);
        return false;
    }
};

// Uniform numbers in (-1, 1).
struct Random {
    std::uint32_t count = 0;
    double operator()() { return symmetric(draw({1, 0, 0, 0}, Purpose::start, 0, count++)[0]); }
};

struct Thrown {
    double heading, vx, vy, spin;
};

// Where it is after a second.
Pose thrown(const Thrown& t, double time_step, bool by_reference) {
    Fixture fixture({-0.45, -0.45, 0});
    fixture.without_noise().box_at(0, 0, t.heading).config.physics.time_step = time_step;
    const double velocity[] = {t.vx, t.vy, t.spin};
    std::copy_n(velocity, 3, fixture.config.movables[0].velocity);
    const Scene scene = fixture.scene();
    if (by_reference) {
        PlanarTwin twin(scene);
        twin.run(1);
        return twin.movable_pose(0);
    }
    World world(scene, starts_of(scene));
    run(world, 1, time_step);
    CHECK(world.unsolved_steps() == 0);
    return world.movable_pose(0);
}

}  // namespace

TEST_CASE("a standing box stands as long as its feet hold, whether it is expected to or not, and then moves") {
    // One per cent beyond what the feet hold is worth 3 mm/s in each step. What sticks moves by kStickSlip until its
    // force is there; ODE's rows may miss it by kRubError.
    constexpr double kMoving = 5e-3, kStill = 1e-5, kStillByOde = 2e-3;
    constexpr int kLoads = 300, kSteps = 4;
    Random random;
    int left_to_ode = 0;
    for (int i = 0; i < kLoads; ++i) {
        CAPTURE(i);
        const double heading = kPi * random();
        LoneBox box(0, 0, heading);
        box.box.place_at(box.place());
        Load load{random(), random(), 0.2 * random()};
        Feet feet;
        for (int foot = 0; foot < Movable::kCorners; ++foot) feet[foot] = box.box.corner(foot);
        // hold_of() gives the factor itself near 1 alone.
        for (int k = 0; k < 60; ++k) {
            const double factor = hold_of(feet, box.limit, load, 1e-5).factor;
            const double scale = std::clamp(factor, 0.9, 1.1);
            load = {scale * load.x, scale * load.y, scale * load.torque};
        }
        const auto at = [&](double part) { return Load{part * load.x, part * load.y, part * load.torque}; };
        CHECK(box.holds(at(0.99)));
        CHECK_FALSE(box.holds(at(1.01)));
        for (const bool is_still : {true, false})
            for (const bool by_ode : {true, false}) {
                CAPTURE(is_still);
                CAPTURE(by_ode);
                const auto pushed = [&](double part) {
                    LoneBox stepped(0, 0, heading);
                    bool any = false;
                    for (int step = 0; step < kSteps; ++step)
                        any |= stepped.step(at(part), is_still && step == 0, by_ode) && !by_ode;
                    left_to_ode += any;
                    return stepped.speed();
                };
                const int before = left_to_ode;
                const double still = pushed(0.99);
                CHECK(still < (by_ode || left_to_ode > before ? kStillByOde : kStill));
                CHECK(pushed(by_ode ? 1.01 + kRubError : 1.01) > kMoving);
            }
    }
    CHECK(left_to_ode < 0.05 * kLoads);
}

TEST_CASE("a wall holds a box against what presses on it, between the corners that touch it") {
    const double half_x = LoneBox().scene.movables[0].config.size[0] / 2,
                 half_y = LoneBox().scene.movables[0].config.size[1] / 2;
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

TEST_CASE("a box that is thrown comes to rest where the reference's does, at every time step") {
    constexpr double kFastest = 0.6, kFastestSpin = 6, kShare = 0.02, kTurn = 0.2 * kRadiansPerDegree;
    // Steps of a thrown box are as long as kThrownDistance; friction has one direction in each, that of its end.
    constexpr double kWay = kThrownDistance / 5;
    Random random;
    for (int i = 0; i < 30; ++i) {
        const double speed = kFastest * std::abs(random()), direction = kPi * random();
        const Thrown t{kPi * random(), speed * std::cos(direction), speed * std::sin(direction),
                       kFastestSpin * random()};
        const Pose there = thrown(t, kStep, true);
        const double way = std::hypot(there.x, there.y), turn = there.heading - t.heading;
        for (const double time_step : {0.005, 0.02, 0.05}) {
            const Pose here = thrown(t, time_step, false);
            INFO("thrown at ", t.heading, " rad with ", t.vx, ", ", t.vy, " m/s and ", t.spin, " rad/s, step ",
                 time_step, " s");
            CHECK(std::hypot(here.x - there.x, here.y - there.y) < std::max(kShare * way, kWay));
            CHECK(std::abs(std::remainder(here.heading - t.heading - turn, 2 * kPi)) <
                  std::max(kShare * std::abs(turn), kTurn));
        }
    }
}

TEST_CASE("a box that turns does not slide as on rails") {
    // Where its corners go round, friction points along their ways, and less of it is left against that of the middle.
    const Thrown straight{0, 0, 0.3, 0}, turning{0, 0, 0.3, 3};
    const Pose reference = thrown(turning, kStep, true);
    for (const double time_step : {0.005, 0.02, 0.05}) {
        const Pose slid = thrown(straight, time_step, false), turned = thrown(turning, time_step, false);
        CHECK(turned.y > 1.4 * slid.y);
        CHECK(turned.y == doctest::Approx(reference.y).epsilon(0.02));
        CHECK(turned.heading == doctest::Approx(reference.heading).epsilon(0.05));
    }
}

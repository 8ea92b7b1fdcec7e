// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "error.hpp"
#include "fixture.hpp"
#include "rng.hpp"
#include "world/compliant.hpp"
#include "world/constants.hpp"

using namespace swarmevo;

namespace {

constexpr int kRobots = 4;
constexpr double kTopSpeed = 6.28 * 0.0205;  // [m/s]

// Uniform numbers in (-1, 1).
struct Random {
    std::uint32_t scene, count = 0;
    double operator()() { return symmetric(draw({3, 0, scene, 0}, Purpose::start, 0, count++)[0]); }
};

// Robots in a row that press on the box and on each other, all in motion, and one step of it, by either solver.
struct Crowd {
    Fixture fixture;
    const Scene scene;
    OdeWorld world;
    Contacts contacts{world, scene.physics};
    AverageVelocity average{true};
    Sides sides{scene, average};
    std::vector<std::unique_ptr<Drive>> drives;
    Movable box{scene, scene.movables[0], world.id(), starts_of(scene).movables[0]};
    const double step;

    Crowd(std::uint32_t number, double time_step, int bumper)
        : fixture(poses(number, bumper)), scene(prepared(fixture, bumper)), step(time_step) {
        dWorldSetERP(world.id(), scene.physics.contact_erp);
        dWorldSetCFM(world.id(), scene.physics.contact_cfm);
        Random random{number + 1000};
        for (int i = 0; i < kRobots; ++i) {
            drives.push_back(create_driven_contacts(scene, world.id(), scene.start_poses[i]));
            drives.back()->set_rim_speeds(kTopSpeed * random(), kTopSpeed * random());
            move(drives.back()->body(), 0.1 * random(), 0.1 * random(), random());
            average.add_body(drives.back()->body(), {6, 100, scene.robot.radius});
        }
        move(box.body(), 0.1 * random(), 0.1 * random(), 0.5 * random());
        box.set_number(kRobots);
        average.add_body(box.body(), {6, 60, box.figure().reach});
    }

    // Sprung bumpers are pressed in by up to 4 mm, or stand clear; rigid ones are up to 2 mm apart.
    static std::vector<double> poses(std::uint32_t number, int bumper) {
        Random random{number};
        const double spacing = bumper == SWE_BUMPER_SPRUNG ? 0.07 : 0.0725,
                     jitter = bumper == SWE_BUMPER_SPRUNG ? 2 : 1;
        const double away = bumper == SWE_BUMPER_SPRUNG ? 0.034 : 0.0361;
        std::vector<double> all;
        for (int i = 0; i < kRobots; ++i) {
            const double pose[] = {spacing * (i - (kRobots - 1) / 2.0) + 0.001 * jitter * random(),
                                   0.2 - 0.09 - away + 0.001 * jitter * random(), kPi / 2 + random()};
            all.insert(all.end(), pose, pose + 3);
        }
        return all;
    }

    static Scene prepared(Fixture& fixture, int bumper) {
        fixture.box_at(0, 0.2).without_noise();
        fixture.config.robot.bumper = bumper;
        fixture.config.team.start =
            SWE_START_RANDOM;  // poses that touch are no start of an experiment: taken from below
        Scene scene = fixture.scene();
        std::vector<Pose>& starts = const_cast<std::vector<Pose>&>(scene.start_poses);
        for (int i = 0; i < kRobots; ++i)
            starts.push_back({fixture.poses[3 * i], fixture.poses[3 * i + 1], fixture.poses[3 * i + 2]});
        return scene;
    }

    static void move(dBodyID body, double vx, double vy, double spin) {
        dBodySetLinearVel(body, vx, vy, 0);
        dBodySetAngularVel(body, 0, 0, spin);
    }

    Sides::Solid solid(int i) const { return {drives[i]->body(), i, 1}; }

    void lay_out() {
        average.begin(step, true);
        sides.begin();
        box.place_at(average.place(kRobots));
        for (int i = 0; i < kRobots; ++i) {
            sides.add_robot_at_walls(solid(i));
            for (int j = 0; j < i; ++j) sides.add_robots(solid(i), solid(j));
            sides.add_push(solid(i), box, 0);
        }
        sides.add_movable_at_walls(box, 0);
    }

    bool by_newton() {
        expect();
        lay_out();
        contacts.begin(step, false);
        CompliantStep compliant(contacts, kForceError * traction_limit(scene));
        compliant.begin(step);
        for (int i = 0; i < kRobots; ++i) {
            compliant.add_body(i, drives[i]->body(), average.place(i), drives[i].get());
            drives[i]->add_to(compliant, average.place(i));
        }
        compliant.add_body(kRobots, box.body(), average.place(kRobots), nullptr);
        box.add_to(compliant);
        for (Sides::Pair* pair : sides.pairs()) compliant.add_pair(*pair);
        return compliant.solve();
    }

    bool by_ode() {
        std::vector<BodyState> before;
        for (const dBodyID body : bodies()) before.push_back(state_of(body));
        expect();
        for (int tries = 0; tries < 60; ++tries) {
            for (std::size_t i = 0; i < before.size(); ++i) set_state(bodies()[i], before[i]);
            lay_out();
            contacts.begin(step, false);
            for (int i = 0; i < kRobots; ++i) {
                average.place_body(i);
                drives[i]->add_to(contacts, average.place(i));
            }
            average.place_body(kRobots);
            box.add_to(contacts);
            sides.add_to(contacts);
            if (world.step(step) > 0) return false;
            sides.read_forces();
            bool all = sides.fits();
            for (const auto& drive : drives) all &= drive->fits();
            if (box.fits() && all) return true;
        }
        return false;
    }

    void expect() {
        box.expect();
        for (const auto& drive : drives) drive->expect();
    }

    std::vector<dBodyID> bodies() const {
        std::vector<dBodyID> all;
        for (const auto& drive : drives) all.push_back(drive->body());
        all.push_back(box.body());
        return all;
    }
};

}  // namespace

TEST_CASE("a step of bodies in touch comes out as ODE's solver has it") {
    for (const int bumper : {SWE_BUMPER_SPRUNG, SWE_BUMPER_RIGID})
        for (const double time_step : {0.005, 0.02}) {
            int compared = 0;
            double mean = 0;
            for (std::uint32_t number = 0; number < 100; ++number) {
                Crowd here(number, time_step, bumper), there(number, time_step, bumper);
                if (!here.by_newton() || !there.by_ode()) continue;
                ++compared;
                double apart = 0;
                for (int i = 0; i <= kRobots; ++i) {
                    const BodyState a = state_of(here.bodies()[i]), b = state_of(there.bodies()[i]);
                    const double lever = i < kRobots ? here.scene.robot.radius : here.box.figure().reach;
                    apart = std::max({apart, std::hypot(a.velocity[0] - b.velocity[0], a.velocity[1] - b.velocity[1]),
                                      lever * std::abs(a.spin[2] - b.spin[2])});
                }
                // ODE's friction may miss the law by kRubError: that much of a wheel's traction in a step.
                CAPTURE(number);
                CAPTURE(time_step);
                CHECK(apart < 0.02);
                mean += apart;
            }
            CAPTURE(bumper);
            CHECK(compared > 50);
            CHECK(mean / compared < 0.003);
        }
}

TEST_CASE("forces that are no numbers are an error") {
    Crowd crowd(1, 0.02, SWE_BUMPER_SPRUNG);
    crowd.drives[0]->set_rim_speeds(NAN, 0.1);
    CHECK_THROWS_WITH_AS(crowd.by_newton(), doctest::Contains("not finite"), Error);
}

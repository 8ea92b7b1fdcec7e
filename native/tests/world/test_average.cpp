// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <cmath>

#include "fixture.hpp"
#include "world/average.hpp"
#include "world/world.hpp"

using namespace swarmevo;

TEST_CASE("a sliding box stops after v^2 / (2 mu g), at every time step") {
    for (const double time_step : {0.001, 0.005, 0.02, 0.05})
        for (const double speed : {0.1, 0.5, 1.5}) {
            Fixture fixture({-0.4, -0.4, 0});
            fixture.without_noise().box_at(0, 0, 0.7).config.physics.time_step = time_step;
            fixture.config.movables[0].velocity[0] = 0.6 * speed;
            fixture.config.movables[0].velocity[1] = 0.8 * speed;
            const Scene scene = fixture.scene();
            World world(scene, starts_of(scene));
            run(world, 1, time_step);
            const double way = speed * speed / (2 * scene.movables[0].config.friction * scene.physics.gravity);
            const Pose box = world.movable_pose(0);
            CHECK(std::hypot(box.x, box.y) == doctest::Approx(way).epsilon(0.01));
            CHECK(std::atan2(box.y, box.x) == doctest::Approx(std::atan2(0.8, 0.6)).epsilon(1e-3));
            CHECK(box.heading == doctest::Approx(0.7).epsilon(1e-3));
        }
}

TEST_CASE("a robot that starts lags behind its wheels by v^2 / (2 mu g), at every time step") {
    for (const double time_step : {0.0005, 0.02, 0.05}) {
        Fixture fixture({-0.3, -0.2, 0});
        fixture.without_noise().config.physics.time_step = time_step;
        const Scene scene = fixture.scene();
        World world(scene, starts_of(scene));
        world.set_rim_speeds(0, 0.12, 0.12);
        run(world, 2, time_step);
        const double lag = 0.12 * 0.12 / (2 * scene.physics.wheel_friction * scene.physics.gravity);
        CHECK(world.robot_pose(0).x + 0.3 == doctest::Approx(0.24 - lag).epsilon(0.002));
    }
}

TEST_CASE("a robot that runs into a wall between two steps stops where the wall holds its bumper") {
    for (const int bumper : {SWE_BUMPER_SPRUNG, SWE_BUMPER_RIGID})
        for (const double time_step : {0.005, 0.01, 0.02, 0.05})
            for (int phase = 0; phase < 10; ++phase) {  // of the collision in its step
                CAPTURE(bumper);
                CAPTURE(time_step);
                CAPTURE(phase);
                Fixture fixture({0.3 - 0.0006 * phase, 0, 0});
                fixture.without_noise().config.physics.time_step = time_step;
                fixture.config.robot.bumper = bumper;
                const Scene scene = fixture.scene();
                World world(scene, starts_of(scene));
                world.set_rim_speeds(0, 0.12, 0.12);
                run(world, 2, time_step);
                const double wall = scene.arena.bounds()[1] - scene.robot.radius, x = world.robot_pose(0).x;
                if (bumper == SWE_BUMPER_SPRUNG)
                    CHECK(std::abs(x - wall - traction_limit(scene) / scene.robot.bumper_stiffness) <
                          0.02 * scene.robot.bumper_travel);
                else
                    CHECK(x == doctest::Approx(wall).epsilon(1e-4));
                CHECK(world.extremes().penetration < 1e-4);
                CHECK(world.ode_messages() == 0);
            }
}

TEST_CASE("sides are likely to meet or not, by the shove that it would take") {
    constexpr double kStep = 0.05;
    // A body before a wall: `gap` at the start of the step; its speeds before it, as its drive means to, and after it.
    struct Approach {
        double gap, before, intended, after;
        bool cautious = false;
        double travel = 0;
    };
    struct Outcome {
        bool likely, kept_clear;
    };
    const auto meet = [&](const Approach& a, bool drifts) {
        OdeWorld world;
        const dBodyID body = create_level_body(world.id(), {0, 0, 0}, 0, 1, 1);
        dBodySetLinearVel(body, a.before, 0, 0);
        AverageVelocity average(drifts);
        average.add_body(body, {1, 1, 0.035});
        average.begin(kStep, a.cautious);
        average.intend(0, a.intended, 0);
        AverageVelocity::Touch touch{};
        touch.first = 0;
        touch.second = AverageVelocity::kWall;
        touch.normal_x = -1;
        touch.gap = a.gap - average.place(0).x;
        touch.travel = a.travel;
        const bool likely = average.note(touch);
        CHECK(touch.gap == doctest::Approx(a.gap));
        CHECK(average.touches().size() == (likely ? 1 : 0));
        CHECK(likely == average.may_close(a.gap));
        dBodySetLinearVel(body, a.after, 0, 0);
        average.read_velocities();
        return Outcome{likely, average.kept_clear()};
    };
    for (const bool drifts : {true, false}) {
        CAPTURE(drifts);
        // Pushes by others may add kPushAllowance: 1 mm in a step, and the slack beyond it.
        CHECK(meet({0.00105, 0, 0, 0}, drifts).likely);
        CHECK_FALSE(meet({0.00115, 0, 0, 0}, drifts).likely);
        // 4 mm take 78 mm/s, by what it does or means to do.
        CHECK(meet({0.004, 0.07, 0, 0}, drifts).likely);
        CHECK(meet({0.004, 0, 0.07, 0}, drifts).likely);
        CHECK_FALSE(meet({0.004, 0.05, 0.05, 0}, drifts).likely);
        CHECK_FALSE(meet({0.004, -0.07, -0.07, 0}, drifts).likely);

        // What was not likely is looked at after the step.
        CHECK_FALSE(meet({0.004, 0, 0, 0.079}, drifts).likely);
        CHECK(meet({0.004, 0, 0, 0.079}, drifts).kept_clear);
        CHECK_FALSE(meet({0.004, 0, 0, 0.081}, drifts).kept_clear);
        // A bumper makes up for a little.
        CHECK(meet({0.004, 0, 0, 0.084, false, 0.006}, drifts).kept_clear);
        CHECK_FALSE(meet({0.004, 0, 0, 0.086, false, 0.006}, drifts).kept_clear);

        CHECK(meet({0.004, 0, 0, 0.081, true}, drifts).likely);
        CHECK(meet({0.004, 0, 0, 0.081, true}, drifts).kept_clear);
    }
}

TEST_CASE("a robot that runs into a wall is a mass on a damped spring, whenever in a step it comes") {
    // m x'' = F - c x' - k x from x = 0 and x' = v on: its wheels slip at once, and push with all their traction F.
    const Scene scene = Fixture({0, 0, 0}).without_noise().scene();
    const double m = scene.robot.mass, k = scene.robot.bumper_stiffness, v = 0.128;
    const double pull = traction_limit(scene), decay = scene.robot.bumper_damping / (2 * m);
    const double frequency = std::sqrt(k / m - decay * decay), settled = pull / k;
    const auto depth = [&](double time) {
        return settled + std::exp(-decay * time) * ((v - decay * settled) / frequency * std::sin(frequency * time) -
                                                    settled * std::cos(frequency * time));
    };
    for (const double time_step : {0.005, 0.01, 0.02, 0.05})
        for (int phase = 0; phase < 10; ++phase) {
            CAPTURE(time_step);
            CAPTURE(phase);
            const double way = 0.0064 + v * time_step * phase / 10;
            const double wall = scene.arena.bounds()[1] - scene.robot.radius;
            Fixture fixture({wall - way, 0, 0});
            fixture.without_noise().config.physics.time_step = time_step;
            const Scene timed = fixture.scene();
            World world(timed, starts_of(timed));
            world.set_rim_speeds(0, v, v);
            const double lag = v / (2 * pull / m);  // until wheels have sped it up
            double largest = 0;
            for (int i = 1; i * time_step < 0.5; ++i) {
                world.step();
                const double since = i * time_step - way / v - lag;  // it touched
                if (since > 0) largest = std::max(largest, std::abs(world.robot_pose(0).x - wall - depth(since)));
            }
            CHECK(largest < 2e-4);
        }
}

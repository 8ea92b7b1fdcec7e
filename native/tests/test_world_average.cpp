// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <cmath>

#include "fixture.hpp"
#include "world.hpp"
#include "world_average.hpp"

using namespace swarmevo;

TEST_CASE("a sliding box stops after v^2 / (2 mu g), at every time step") {
    for (const double time_step : {0.001, 0.005, 0.02, 0.05})
        for (const double speed : {0.1, 0.5, 1.5}) {
            Fixture fixture({-0.4, -0.4, 0});
            fixture.without_noise().box_at(0, 0, 0.7).config.physics.time_step = time_step;
            fixture.config.box.velocity[0] = 0.6 * speed;
            fixture.config.box.velocity[1] = 0.8 * speed;
            const Scene scene = fixture.scene();
            World world(scene, scene.start_poses);
            run(world, 1, time_step);
            const double way = speed * speed / (2 * scene.physics.box_friction * scene.physics.gravity);
            const Pose box = world.box_pose();
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
        World world(scene, scene.start_poses);
        world.set_rim_speeds(0, 0.12, 0.12);
        run(world, 2, time_step);
        const double lag = 0.12 * 0.12 / (2 * scene.physics.wheel_friction * scene.physics.gravity);
        CHECK(world.robot_pose(0).x + 0.3 == doctest::Approx(0.24 - lag).epsilon(0.002));
    }
}

TEST_CASE("a robot that runs into a wall between two steps stops at the wall") {
    for (const double time_step : {0.01, 0.02, 0.05})
        for (int phase = 0; phase < 10; ++phase) {  // of the collision in its step
            Fixture fixture({0.3 - 0.0006 * phase, 0, 0});
            fixture.without_noise().config.physics.time_step = time_step;
            const Scene scene = fixture.scene();
            World world(scene, scene.start_poses);
            world.set_rim_speeds(0, 0.12, 0.12);
            run(world, 2, time_step);
            CHECK(world.robot_pose(0).x == doctest::Approx(0.465).epsilon(1e-4));
            CHECK(world.extremes().penetration < 1e-4);
            CHECK(world.ode_messages() == 0);
        }
}

TEST_CASE("bodies are likely to meet, unlikely to, or far from it, by the shove that it would take") {
    using Meeting = AverageVelocity::Meeting;
    constexpr double kStep = 0.05;
    const auto meeting = [&](double gap, bool cautious, double then, double now, bool* kept_clear) {
        OdeWorld world;
        const dBodyID body = create_level_body(world.id(), {0, 0, 0}, 0, 1, 1);
        dBodySetLinearVel(body, then, 0, 0);
        AverageVelocity average;
        average.add_body(body, {1, 1});
        average.begin(kStep, cautious);
        const Meeting found = average.note({0, AverageVelocity::kWall, 0, 0, -1, 0, gap});
        dBodySetLinearVel(body, now, 0, 0);
        *kept_clear = average.kept_clear();
        return found;
    };
    bool kept_clear = false;
    CHECK(meeting(0.001, false, 0, 0, &kept_clear) == Meeting::likely);
    CHECK(meeting(0.004, false, 0.07, 0, &kept_clear) == Meeting::likely);
    CHECK(meeting(0.004, false, 0, 0.079, &kept_clear) == Meeting::unlikely);
    CHECK(kept_clear);
    CHECK(meeting(0.004, false, 0, 0.081, &kept_clear) == Meeting::unlikely);
    CHECK_FALSE(kept_clear);
    CHECK(meeting(0.004, true, 0, 0.081, &kept_clear) == Meeting::likely);
    CHECK(kept_clear);
    CHECK(meeting(0.006, false, 0, 0.119, &kept_clear) == Meeting::far);
    CHECK(kept_clear);
    CHECK(meeting(0.006, false, 0, 0.121, &kept_clear) == Meeting::far);
    CHECK_FALSE(kept_clear);
}

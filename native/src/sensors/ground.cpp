// SPDX-License-Identifier: BSD-3-Clause
#include "sensors/ground.hpp"

#include <algorithm>
#include <cmath>

namespace swarmevo {
namespace {

unsigned width(const swe_scene_config& checked) {
    return checked.sensors.ground_count;
}

void sense(const Glimpse& glimpse, double* readings) {
    const Pose& me = glimpse.me();
    const double cosine = std::cos(me.heading), sine = std::sin(me.heading);
    for (unsigned i = 0; i < glimpse.scene.sensors.ground_count; ++i) {
        const auto& [ahead, left] = glimpse.scene.sensors.ground_position[i];
        double grey =
            ground_grey(glimpse.scene, me.x + cosine * ahead - sine * left, me.y + sine * ahead + cosine * left);
        if (glimpse.scene.noise.ground > 0) {
            const auto words = glimpse.draw(Purpose::ground, i);
            grey += glimpse.scene.noise.ground * normal(words[0], words[1]);
        }
        readings[i] = std::clamp(grey, 0.0, 1.0);
    }
}

}  // namespace

double ground_grey(const Scene& scene, double x, double y) {
    const swe_ground_config& ground = scene.ground;
    for (unsigned i = ground.n_patches; i-- > 0;) {  // the later one is on top
        const swe_patch_config& patch = ground.patches[i];
        const Figure figure = Figure::of(patch.shape, patch.size[0], patch.size[1], 0);
        if (distance(figure, {patch.pose[0], patch.pose[1], patch.pose[2]}, x, y) <= 0) return patch.grey;
    }
    return ground.grey;
}

const Device kGround = {SWE_SENSOR_GROUND, width, sense};

}  // namespace swarmevo

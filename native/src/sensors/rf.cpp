// SPDX-License-Identifier: BSD-3-Clause
#include "sensors/rf.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "scene/scene.hpp"

namespace swarmevo {
namespace {

double distance_squared(const Scene& scene, const swe_emitter_config& emitter, const Snapshot& now, unsigned robot) {
    const auto source = place_of(emitter, now);
    const Pose& me = now.robots[robot];
    return square(me.x - source[0]) + square(me.y - source[1]) + square(scene.robot.height - source[2]);
}

// Those that are not of lights; one where there is no emitter.
unsigned radio_channels(const swe_emitter_config* emitters, std::size_t n) {
    unsigned channels = 1;
    for (std::size_t i = 0; i < n; ++i)
        if (emitters[i].channel != SWE_CHANNEL_LIGHT) channels = std::max(channels, emitters[i].channel + 1);
    return channels;
}

unsigned radio_channels(const swe_scene_config& checked) {
    return radio_channels(checked.emitters, checked.n_emitters);
}

unsigned radio_channels(const Scene& scene) {
    return radio_channels(scene.emitters.data(), scene.emitters.size());
}

// Largest strength of a channel's emitters, by which its readings are divided; 1 where there is none.
double strongest_signal(const Scene& scene, unsigned channel) {
    double most = 0;
    for (const swe_emitter_config& emitter : scene.emitters)
        if (emitter.channel == channel) most = std::max(most, emitter.strength[1]);
    return most > 0 ? most : 1;
}

// Is an emitter heard that is so far away [m^2]?
bool is_heard(const swe_emitter_config& emitter, double distance_squared) {
    return emitter.reach != SWE_REACH_RANGE || distance_squared <= square(emitter.range);
}

unsigned strengths(const swe_scene_config& checked) {
    return radio_channels(checked);
}

unsigned bearings(const swe_scene_config& checked) {
    return 2 * radio_channels(checked);
}

void sense_strengths(const Glimpse& glimpse, double* readings) {
    for (unsigned channel = 0; channel < radio_channels(glimpse.scene); ++channel)
        readings[channel] = signal_strength(glimpse, channel) / strongest_signal(glimpse.scene, channel);
}

// The nearest emitter of a channel that is heard; null if there is none.
const swe_emitter_config* nearest_heard(const Glimpse& glimpse, unsigned channel) {
    const swe_emitter_config* nearest = nullptr;
    double shortest = kNothing;
    for (const swe_emitter_config& emitter : glimpse.scene.emitters) {
        const double squared = distance_squared(glimpse.scene, emitter, glimpse.now, glimpse.robot);
        if (emitter.channel != channel || !is_heard(emitter, squared) || squared >= shortest) continue;
        nearest = &emitter, shortest = squared;
    }
    return nearest;
}

// Straight below or above the receiver an emitter has no bearing.
void sense_bearing(const Glimpse& glimpse, unsigned channel, double* readings) {
    readings[0] = readings[1] = 0;
    const swe_emitter_config* emitter = nearest_heard(glimpse, channel);
    if (!emitter) return;
    const auto source = place_of(*emitter, glimpse.now);
    const Pose& me = glimpse.me();
    const double x = source[0] - me.x, y = source[1] - me.y;
    if (x == 0 && y == 0) return;
    double bearing = std::atan2(y, x) - me.heading;
    if (glimpse.scene.noise.rf_bearing > 0) {
        const auto words = glimpse.draw(Purpose::rf_bearing, channel);
        bearing += glimpse.scene.noise.rf_bearing * normal(words[0], words[1]);
    }
    readings[0] = std::cos(bearing), readings[1] = std::sin(bearing);
}

void sense_bearings(const Glimpse& glimpse, double* readings) {
    for (unsigned channel = 0; channel < radio_channels(glimpse.scene); ++channel)
        sense_bearing(glimpse, channel, readings + 2 * channel);
}

}  // namespace

std::array<double, 3> place_of(const swe_emitter_config& emitter, const Snapshot& now) {
    const double *p = emitter.position, x = p[0], y = p[1];
    if (emitter.rides_on == SWE_NOTHING) return {x, y, p[2]};
    const Pose& carrier = now.movables[emitter.rides_on];
    const double cosine = std::cos(carrier.heading), sine = std::sin(carrier.heading);
    return {carrier.x + cosine * x - sine * y, carrier.y + sine * x + cosine * y, p[2]};
}

bool in_emitter_range(const Scene& scene, const Snapshot& now, unsigned robot) {
    return std::any_of(scene.emitters.begin(), scene.emitters.end(), [&](const swe_emitter_config& emitter) {
        return emitter.channel == 0 && distance_squared(scene, emitter, now, robot) <= square(emitter.range);
    });
}

bool is_heard(const Glimpse& glimpse, const swe_emitter_config& emitter) {
    return is_heard(emitter, distance_squared(glimpse.scene, emitter, glimpse.now, glimpse.robot));
}

double strength_of(const Glimpse& glimpse, unsigned number, Purpose purpose, double deviation) {
    const swe_emitter_config& emitter = glimpse.scene.emitters[number];
    const double least = emitter.strength[0], most = emitter.strength[1];
    const double squared = distance_squared(glimpse.scene, emitter, glimpse.now, glimpse.robot);
    if (!is_heard(emitter, squared)) return least;
    double strength = 1 / std::max(squared, std::numeric_limits<double>::min());
    if (deviation > 0) {
        const auto words = glimpse.draw(purpose, number);
        strength *= 1 + deviation * normal(words[0], words[1]);
    }
    return std::clamp(strength, least, most);
}

double signal_strength(const Glimpse& glimpse, unsigned channel) {
    const Scene& scene = glimpse.scene;
    double strongest = 0;
    for (unsigned i = 0; i < scene.emitters.size(); ++i)
        if (scene.emitters[i].channel == channel)
            strongest = std::max(strongest, strength_of(glimpse, i, Purpose::rf, scene.noise.rf));
    return strongest;
}

const Device kRf = {SWE_SENSOR_RF, strengths, sense_strengths};
const Device kRfBearing = {SWE_SENSOR_RF_BEARING, bearings, sense_bearings};

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
#include "world/rectangles.hpp"

#include <algorithm>
#include <cmath>

namespace swarmevo {
namespace {

// Of two faces that part equally well, the first rectangle's: else they would take turns [m].
constexpr double kPreference = 1e-6;

// A side of a rectangle: its outward normal, its middle and half its length.
struct Face {
    double normal_x, normal_y, x, y, half_length;
    double gap;  // to the other rectangle's nearest corner [m]
};

// The one that best parts a rectangle from another.
Face best_face(const Figure& own, const Place& at, const Figure& other, const Place& there) {
    const double dx = there.x - at.x, dy = there.y - at.y;
    const double along = dx * at.cosine + dy * at.sine, across = dy * at.cosine - dx * at.sine;
    const double c = std::abs(at.cosine * there.cosine + at.sine * there.sine);
    const double s = std::abs(at.cosine * there.sine - at.sine * there.cosine);
    const double gap_x = std::abs(along) - own.half_x - c * other.half_x - s * other.half_y;
    const double gap_y = std::abs(across) - own.half_y - s * other.half_x - c * other.half_y;
    const bool is_x = gap_x > gap_y;
    const double sign = std::copysign(1.0, is_x ? along : across);
    const Vector normal = is_x ? at.turned(sign, 0) : at.turned(0, sign);
    const double out = is_x ? own.half_x : own.half_y;
    return {
        normal[0],           normal[1], at.x + out * normal[0], at.y + out * normal[1], is_x ? own.half_y : own.half_x,
        is_x ? gap_x : gap_y};
}

// The side of a rectangle that looks most against a direction.
Face facing(const Figure& figure, const Place& at, double x, double y) {
    const double along = x * at.cosine + y * at.sine, across = y * at.cosine - x * at.sine;
    const bool is_x = std::abs(along) > std::abs(across);
    const double sign = -std::copysign(1.0, is_x ? along : across);
    const Vector normal = is_x ? at.turned(sign, 0) : at.turned(0, sign);
    const double out = is_x ? figure.half_x : figure.half_y;
    return {normal[0], normal[1], at.x + out * normal[0], at.y + out * normal[1], is_x ? figure.half_y : figure.half_x,
            0};
}

}  // namespace

Meetings meetings_of_rectangles(const Figure& first, const Place& first_place, const Figure& second,
                                const Place& second_place) {
    const Face of_first = best_face(first, first_place, second, second_place);
    const Face of_second = best_face(second, second_place, first, first_place);
    const bool is_first = of_first.gap > of_second.gap - kPreference;
    const Face& face = is_first ? of_first : of_second;
    const Face side = is_first ? facing(second, second_place, face.normal_x, face.normal_y)
                               : facing(first, first_place, face.normal_x, face.normal_y);
    // Along the face, from its middle: the side's ends, as x + t (y - x) with what is cut off.
    const double tx = -face.normal_y, ty = face.normal_x;  // along the face
    const double ux = -side.normal_y, uy = side.normal_x;  // along the side
    const double slope = ux * tx + uy * ty, middle = (side.x - face.x) * tx + (side.y - face.y) * ty;
    const double reach = std::abs(slope) * side.half_length;
    const double low = std::max(middle - reach, -face.half_length), high = std::min(middle + reach, face.half_length);
    Meetings meetings;
    if (low > high) return meetings;
    const double sign = is_first ? -1 : 1;  // normals lead to the first
    const double height = std::min(first.height, second.height) / 2;
    for (const double at : {is_first ? high : low, is_first ? low : high}) {
        const double t = std::abs(slope) > 0 ? (at - middle) / slope : 0;
        const double x = side.x + t * ux, y = side.y + t * uy;
        const double gap = (x - face.x) * face.normal_x + (y - face.y) * face.normal_y;
        meetings.add({x, y, height, sign * face.normal_x, sign * face.normal_y, gap});
    }
    return meetings;
}

}  // namespace swarmevo

// SPDX-License-Identifier: BSD-3-Clause
// Shapes of the reference, and where they overlap: discs and rectangles that meet each other and the arena's walls.
#ifndef SWARMEVO_REFERENCE_SHAPES_HPP
#define SWARMEVO_REFERENCE_SHAPES_HPP

#include <array>
#include <cstddef>
#include <vector>

namespace swarmevo_reference {

// A disc of this diameter, or a rectangle, about its middle.
struct Figure {
    bool is_round = false;
    double length = 0;  // m, along the heading; of a disc its diameter
    double width = 0;   // m, across it; of a disc the same

    // Of the circle about the middle that all of it is in [m].
    double reach() const;
};

struct Pose {
    double x = 0, y = 0;  // m
    double heading = 0;   // rad, anticlockwise from x
};

struct Point {
    double x = 0, y = 0;  // m
};

// A round arena about the origin, or the half planes that a convex polygon is made of.
struct Arena {
    struct Wall {
        Point at;       // on it, m
        Point inwards;  // 1, its normal
    };
    double radius = 0;        // m, of a round one
    std::vector<Wall> walls;  // of another

    static Arena round(double radius);
    static Arena polygon(const std::vector<Point>& corners);  // anticlockwise
    static Arena square(double side);
};

// A point at which one thing is in another: the way out for the first is along the normal, for the depth.
struct Contact {
    double x, y;    // m
    double nx, ny;  // 1, points to the first
    double depth;   // m, above 0
};

// The few contacts of a pair.
class Contacts {
  public:
    void add(const Contact& contact) { all_.at(size_++) = contact; }
    const Contact* begin() const { return all_.data(); }
    const Contact* end() const { return all_.data() + size_; }

  private:
    std::array<Contact, 16> all_;
    std::size_t size_ = 0;
};

// A disc touches at one point, on the surface of the other thing. Two rectangles part by the way that is shortest for
// both as they stand, and touch at each corner of either that is in the other.
Contacts overlap(const Figure& one, const Pose& at, const Figure& other, const Pose& other_at);

// One contact for each wall and point that is beyond it.
Contacts beyond_walls(const Figure& figure, const Pose& at, const Arena& arena);

}  // namespace swarmevo_reference

#endif

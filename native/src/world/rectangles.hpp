// SPDX-License-Identifier: BSD-3-Clause
// Where two rectangles meet.
//
// Of the sides of both, one parts them best: it is the face that they meet at (the separating axis test). The other
// rectangle's side that looks at it is cut to the face's length, and they meet at both ends of what is left. Corners
// that pass each other do not meet.
#pragma once

#include "scene/figure.hpp"
#include "world/ode.hpp"
#include "world/sides.hpp"

namespace swarmevo {

// None, one or two, in an order along the face that does not change from step to step. Normals lead from the second to
// the first.
class Meetings {
  public:
    const Meeting* begin() const { return meetings_; }
    const Meeting* end() const { return meetings_ + count_; }
    void add(const Meeting& meeting) { meetings_[count_++] = meeting; }

  private:
    Meeting meetings_[2];
    int count_ = 0;
};

Meetings meetings_of_rectangles(const Figure& first, const Place& first_place, const Figure& second,
                                const Place& second_place);

}  // namespace swarmevo

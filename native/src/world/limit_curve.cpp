// SPDX-License-Identifier: BSD-3-Clause
#include "world/limit_curve.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

namespace swarmevo {
namespace {

constexpr int kMostReweightings = 200;

}  // namespace

// By weighted least squares: D(t) with each |s| replaced by s^2 / |s of the round before|. Each round gives a motion,
// hence an upper bound of the factor, and forces of the feet that balance the load, hence a lower one.
Hold hold_of(const Feet& feet, double limit, const Load& load, double precision) {
    double reach = 0;
    for (const Vector& foot : feet) reach = std::max(reach, norm(foot[0], foot[1]));
    // Lengths in units of the reach, forces in units of the limit.
    const Eigen::Vector3d wrench = Eigen::Vector3d(load.x, load.y, load.torque / reach) / limit;
    if (wrench.isZero(0)) return {std::numeric_limits<double>::infinity(), {}};
    std::array<double, 4> slips;  // of the feet in the round before, at least a share of the largest
    slips.fill(1);
    Hold best{std::numeric_limits<double>::infinity(), {}};
    for (int round = 0; round < kMostReweightings; ++round) {
        Eigen::Matrix3d drag = Eigen::Matrix3d::Zero();
        for (std::size_t i = 0; i < feet.size(); ++i) {
            const double x = feet[i][0] / reach, y = feet[i][1] / reach;
            Eigen::Matrix<double, 2, 3> velocity;  // of the foot, from the body's
            velocity << 1, 0, -y, 0, 1, x;
            drag += velocity.transpose() * velocity / slips[i];
        }
        Eigen::Vector3d twist = drag.ldlt().solve(wrench);
        twist /= wrench.dot(twist);
        const double scale = twist.dot(drag * twist);
        double work = 0, strongest = 0, fastest = 0;
        std::array<double, 4> found;
        for (std::size_t i = 0; i < feet.size(); ++i) {
            const double x = feet[i][0] / reach, y = feet[i][1] / reach;
            found[i] = norm(twist[0] - twist[2] * y, twist[1] + twist[2] * x);
            work += found[i];
            strongest = std::max(strongest, found[i] / slips[i] / scale);
            fastest = std::max(fastest, found[i]);
        }
        if (work < best.factor) best = {work, {twist[0], twist[1], twist[2] / reach}};
        const double least = 1 / strongest;
        if (least >= 1 || best.factor < 1 || best.factor - least < precision * best.factor) {
            if (least >= 1) best.factor = std::max(1.0, best.factor);
            break;
        }
        for (std::size_t i = 0; i < feet.size(); ++i) slips[i] = std::max(found[i], 1e-9 * fastest);
    }
    return best;
}

}  // namespace swarmevo

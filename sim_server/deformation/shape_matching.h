// Where the rigid kernel of a piece that was cut free is: the rigid motion that fits its vertices best (shape matching,
// Mueller 2005). With the home springs' own stiffness as weights, their forces on the piece add up to no force and no
// torque, so that momentum is that of the piece alone and a rigid motion meets no resistance.
#pragma once

#include <Eigen/Geometry>
#include <span>

#include "common/math/types.h"

namespace sectio {

// The rotation R maximising tr(R^T A), reached from `start` by Newton's method where the trace is concave and by the
// steps of Mueller et al. 2016 elsewhere; quaternion updates without a trigonometric function. Never flips, and is
// defined for flat pieces as well.
Eigen::Quaterniond closest_rotation(const Mat3& a, const Eigen::Quaterniond& start);

struct MatchedPoint {
  Vec3 home_body_m;
  Vec3 at_world_m;
  double weight;
};

// Starts from `last`, the frame a step ago; returns it when no point has weight. Sums in the order of `points`.
Pose match_shape(std::span<const MatchedPoint> points, const Pose& last);

}  // namespace sectio

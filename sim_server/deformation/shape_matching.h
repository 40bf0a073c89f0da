// Shape matching (Mueller et al. 2005): the rigid motion of the rest shape that fits a set of points best. It places
// the rest shape of a piece that was cut free. With the stiffness of the home springs as weights, these springs exert
// no net force and no net torque on the piece: its momentum is conserved, and nothing resists a rigid motion.
#pragma once

#include <Eigen/Geometry>
#include <span>

#include "common/math/types.h"

namespace sectio {

// The rotation R maximising tr(R^T A), reached from `start` by Newton's method where the trace is concave and by the
// steps of Mueller et al. 2016 elsewhere; quaternion updates without a trigonometric function. The result is never a
// reflection, and flat pieces have one, too.
Eigen::Quaterniond closest_rotation(const Mat3& a, const Eigen::Quaterniond& start);

struct MatchedPoint {
  Vec3 rest_body_m;
  Vec3 at_world_m;
  double weight;
};

// Starts from `last`, the frame a step ago; returns it when no point has weight. Sums in the order of `points`.
Pose match_shape(std::span<const MatchedPoint> points, const Pose& last);

}  // namespace sectio

#include "sim_server/deformation/shape_matching.h"

#include <Eigen/LU>
#include <cmath>

namespace sectio {

Eigen::Quaterniond closest_rotation(const Mat3& a, const Eigen::Quaterniond& start) {
  constexpr int kMaxIterations = 30;
  constexpr double kTolerance = 1e-12;  // rad
  Eigen::Quaterniond q = start;
  for (int n = 0; n < kMaxIterations; ++n) {
    // tr(R^T A) grows along `axial`; -(tr(S) 1 - S) is its second derivative, S the symmetric part of A R^T.
    const Mat3 m = a * q.toRotationMatrix().transpose();
    const Vec3 axial(m(2, 1) - m(1, 2), m(0, 2) - m(2, 0), m(1, 0) - m(0, 1));
    const Mat3 curvature = m.trace() * Mat3::Identity() - 0.5 * (m + m.transpose());
    const bool concave =
        curvature(0, 0) > 0 && curvature.topLeftCorner<2, 2>().determinant() > 0 && curvature.determinant() > 0;
    Vec3 turn = axial / (std::abs(m.trace()) + 1e-300);
    if (concave) turn = curvature.inverse() * axial;
    if (!(turn.squaredNorm() > kTolerance * kTolerance)) break;
    if (turn.squaredNorm() > 1) turn.normalize();
    q = Eigen::Quaterniond(1, 0.5 * turn.x(), 0.5 * turn.y(), 0.5 * turn.z()) * q;
    q.normalize();
  }
  return q;
}

Pose match_shape(std::span<const MatchedPoint> points, const Pose& last) {
  double weight = 0;
  Vec3 rest_centre = Vec3::Zero();
  Vec3 centre = Vec3::Zero();
  for (const MatchedPoint& p : points) {
    weight += p.weight;
    rest_centre += p.weight * p.rest_body_m;
    centre += p.weight * p.at_world_m;
  }
  if (!(weight > 0)) return last;
  rest_centre /= weight;
  centre /= weight;
  Mat3 a = Mat3::Zero();
  for (const MatchedPoint& p : points) {
    a += p.weight * (p.at_world_m - centre) * (p.rest_body_m - rest_centre).transpose();
  }
  Pose frame;
  frame.orientation = closest_rotation(a, last.orientation);
  frame.position_m = centre - frame.orientation * rest_centre;
  return frame;
}

}  // namespace sectio

#include "render_client/draw/camera.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace sectio {

Mat3 view_axes(const Camera& camera) {
  Vec3 backward = camera.eye_world_m - camera.target_world_m;
  if (!(backward.norm() > 1e-9)) backward = Vec3::UnitZ();
  backward.normalize();
  Vec3 right = camera.up_world.cross(backward);
  if (!(right.norm() > 1e-6 * std::max(camera.up_world.norm(), 1e-30))) {
    right = backward.unitOrthogonal();
  }
  right.normalize();
  Mat3 axes;
  axes.row(0) = right;
  axes.row(1) = backward.cross(right);
  axes.row(2) = backward;
  return axes;
}

double tangent_of_half_angle(const Camera& camera) {
  return std::tan(0.5 * std::clamp(camera.field_of_view_deg, 1.0, 150.0) * std::numbers::pi / 180.0);
}

Eigen::Vector2d half_slopes(const Camera& camera, double aspect) {
  const double right = tangent_of_half_angle(camera) * std::max(aspect, kNarrowestAspect);
  return {right, right / aspect};
}

Eigen::Matrix4f view_from_world(const Camera& camera) {
  const Mat3 axes = view_axes(camera);
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = axes;
  m.topRightCorner<3, 1>() = -(axes * camera.eye_world_m);
  return m.cast<float>();
}

Eigen::Matrix4f projection(const Camera& camera, double aspect) {
  // 24 bits of depth resolve about 2e-6 of the distance at this ratio of planes.
  const double distance_m = std::max((camera.eye_world_m - camera.target_world_m).norm(), 1e-3);
  const double near_m = 0.05 * distance_m, far_m = 20 * distance_m;
  Eigen::Matrix4d m = Eigen::Matrix4d::Zero();
  m.diagonal().head<2>() = half_slopes(camera, aspect).cwiseInverse();
  m(2, 2) = -(far_m + near_m) / (far_m - near_m);
  m(2, 3) = -2 * far_m * near_m / (far_m - near_m);
  m(3, 2) = -1;
  return m.cast<float>();
}

// The eye is e to the right, so that the view moves by -e. A point at the convergence distance D, in the middle between
// the eyes, is at (-e, 0, -D) for this eye and must appear at x = 0: m00 (-e) + m02 (-D) = 0.
SectionPlane section_at_target(const Camera& camera) {
  const Vec3 to_eye = camera.eye_world_m - camera.target_world_m;
  return {camera.target_world_m, to_eye.norm() > 0 ? Vec3(to_eye.normalized()) : Vec3::UnitZ()};
}

EyeView eye_view(const Camera& camera, double aspect, const Stereo& stereo, int side) {
  const double distance_m = std::max((camera.eye_world_m - camera.target_world_m).norm(), 1e-3);
  const double convergence_m = stereo.convergence_m > 0 ? stereo.convergence_m : distance_m;
  const double apart_m = stereo.eye_separation_m > 0 ? stereo.eye_separation_m : convergence_m / 30;
  const auto e = static_cast<float>(0.5 * side * apart_m);
  EyeView view{view_from_world(camera), projection(camera, aspect)};
  view.view_from_world(0, 3) -= e;
  view.projection(0, 2) = -view.projection(0, 0) * e / static_cast<float>(convergence_m);
  return view;
}

Camera fit_camera(const Frame& frame, double aspect) {
  constexpr double kMargin = 1.08;
  Camera fitted = frame.camera;
  const Mat3 axes = view_axes(frame.camera);
  const Eigen::Array2d slope = half_slopes(frame.camera, aspect).cwiseInverse();
  // A point (x, y, z) in view axes is inside the pyramid of an eye (ex, ey, ez) when slope |x - ex| + z <= ez. Hence
  // the bounds of z + slope x and z - slope x fix ex and ez, and those of y fix ey and ez.
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Eigen::Array2d highest = Eigen::Array2d::Constant(-kInfinity), lowest = highest;
  double nearest = -kInfinity, farthest = kInfinity;
  for (const BodyFrame& body : frame.bodies) {
    for (const Triangle& triangle : body.triangles) {
      if (!triangle.alive()) continue;
      for (const VertexId v : triangle.v) {
        if (v >= body.positions_world_m.size() || !body.positions_world_m[v].allFinite()) continue;
        const Vec3 p = axes * body.positions_world_m[v].cast<double>();
        const Eigen::Array2d across = slope * p.head<2>().array();
        highest = highest.max(p.z() + across);
        lowest = lowest.max(p.z() - across);
        nearest = std::max(nearest, p.z());
        farthest = std::min(farthest, p.z());
      }
    }
  }
  if (!std::isfinite(nearest)) return fitted;
  const Eigen::Array2d across = (highest - lowest) / (2 * slope);
  const double centre_z = 0.5 * (nearest + farthest);
  const double eye_z = std::max(((highest + lowest) / 2).maxCoeff(), nearest + 1e-3);
  const double distance_m = kMargin * (eye_z - centre_z);
  fitted.target_world_m = axes.transpose() * Vec3(across.x(), across.y(), centre_z);
  fitted.eye_world_m = fitted.target_world_m + distance_m * axes.row(2).transpose();
  return fitted;
}

}  // namespace sectio

#include "render_client/draw/orbit_camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render_client/draw/camera.h"

namespace sectio {

namespace {

constexpr double kNearest_m = 0.02, kFarthest_m = 5;
constexpr double kFromPole_rad = 0.05;

}  // namespace

Mat3 level_axes(const Camera& camera) {
  Vec3 away = camera.target_world_m - camera.eye_world_m;
  away.z() = 0;
  if (away.norm() < 1e-6) away = Vec3::UnitY();
  Mat3 axes;
  axes.col(1) = away.normalized();
  axes.col(2) = Vec3::UnitZ();
  axes.col(0) = axes.col(1).cross(axes.col(2));
  return axes;
}

void OrbitCamera::orbit(double right_rad, double up_rad) {
  const Vec3 up = camera_.up_world.normalized();
  const Vec3 arm = camera_.eye_world_m - camera_.target_world_m;
  const double polar_rad = std::acos(std::clamp(arm.normalized().dot(up), -1.0, 1.0));
  const double most_rad = std::numbers::pi - kFromPole_rad;
  const double turned_rad =
      std::clamp(polar_rad - up_rad, std::min(kFromPole_rad, polar_rad), std::max(most_rad, polar_rad));
  const Vec3 right = view_axes(camera_).row(0).transpose();
  const Eigen::AngleAxisd about_right(turned_rad - polar_rad, right);
  const Eigen::AngleAxisd about_up(-right_rad, up);
  camera_.eye_world_m = camera_.target_world_m + about_up * (about_right * arm);
}

void OrbitCamera::pan(double right, double up) {
  const double distance_m = (camera_.eye_world_m - camera_.target_world_m).norm();
  const double height_m = 2 * distance_m * tangent_of_half_angle(camera_);
  const Mat3 a = view_axes(camera_);
  move(-height_m * (right * a.row(0) + up * a.row(1)).transpose());
}

void OrbitCamera::move(const Vec3& by_world_m) {
  camera_.eye_world_m += by_world_m;
  camera_.target_world_m += by_world_m;
}

void OrbitCamera::zoom(double factor) {
  const Vec3 arm = camera_.eye_world_m - camera_.target_world_m;
  const double distance_m = std::clamp(arm.norm() * factor, kNearest_m, kFarthest_m);
  camera_.eye_world_m = camera_.target_world_m + distance_m * view_axes(camera_).row(2).transpose();
}

Ray OrbitCamera::ray(double x, double y, double aspect) const {
  const Eigen::Vector2d slope = half_slopes(camera_, aspect);
  const Mat3 a = view_axes(camera_);
  const Vec3 along = (x * slope.x() * a.row(0) + y * slope.y() * a.row(1) - a.row(2)).transpose();
  return {camera_.eye_world_m, along.normalized()};
}

Vec3 OrbitCamera::project(const Vec3& world_m, double aspect) const {
  const Vec3 p = view_axes(camera_) * (world_m - camera_.eye_world_m);
  const Eigen::Vector2d slope = half_slopes(camera_, aspect);
  const double distance_m = -p.z();
  if (distance_m < 1e-6) return {0, 0, distance_m};
  return {p.x() / (slope.x() * distance_m), p.y() / (slope.y() * distance_m), distance_m};
}

}  // namespace sectio

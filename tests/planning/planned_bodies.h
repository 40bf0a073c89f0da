// Organs and boxes about the origin, how they are turned and held: for the planner's estimates.
#pragma once

#include "sim_server/scene/scene.h"
#include "tests/support/shapes.h"

namespace sectio::test {

constexpr double kFar = 1;
inline Box above(double z_m) {
  return {Vec3(-kFar, -kFar, z_m), Vec3::Constant(kFar)};
}
inline Box below(double z_m) {
  return {Vec3::Constant(-kFar), Vec3(kFar, kFar, z_m)};
}
inline Box beyond(double x_m) {
  return {Vec3::Constant(-kFar), Vec3(x_m, kFar, kFar)};
}
inline TriangleSoup bent(const Vec3& radii_m, double by) {
  TriangleSoup soup = ellipsoid(3, radii_m);
  for (Vec3& p : soup.vertices_body_m) p.z() += by * p.x() * p.x() / radii_m.x();
  return soup;
}
inline TriangleSoup block(const Vec3& size_m) {
  TriangleSoup soup = box(6, 6, 6, size_m);
  for (Vec3& p : soup.vertices_body_m) p -= 0.5 * size_m;
  return soup;
}

inline Eigen::Quaterniond turned(const Vec3& deg) {
  const Vec3 rad = M_PI / 180 * deg;
  return Eigen::AngleAxisd(rad.z(), Vec3::UnitZ()) * Eigen::AngleAxisd(rad.y(), Vec3::UnitY()) *
         Eigen::AngleAxisd(rad.x(), Vec3::UnitX());
}

}  // namespace sectio::test

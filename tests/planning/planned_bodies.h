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

// The scene of one body whose model is to be chosen, awake all the time.
inline Scene planned_scene(const std::string& name, const TriangleSoup& mesh, const Vec3& turned_deg, double young_pa,
                           double poisson, double damping_per_s, double error_budget, double duration_s) {
  Scene scene;
  scene.file = name;
  scene.sleep.after_s = 0;
  scene.duration_s = duration_s;
  BodySpec& body = scene.bodies.emplace_back();
  body.name = name;
  body.model = "auto";
  body.mesh = mesh;
  body.pose.orientation = turned(turned_deg);
  body.material.young_pa = young_pa;
  body.material.poisson = poisson;
  body.material.density_kg_per_m3 = 1050;
  body.material.damping_per_s = damping_per_s;
  body.plan.error_budget = error_budget;
  body.plan.cpu_budget = 4;
  return scene;
}

}  // namespace sectio::test

#include "render_client/page/pick.h"

#include <cmath>

namespace sectio {

SurfaceShot shot_of(const Frame& frame) {
  SurfaceShot shot;
  for (const BodyFrame& body : frame.bodies) shot.bodies.push_back({body.positions_world_m, body.triangles});
  return shot;
}

// Moeller & Trumbore 1997, Fast, Minimum Storage Ray/Triangle Intersection.
std::optional<Hit> pick(const Ray& ray, const SurfaceShot& shot) {
  std::optional<Hit> nearest;
  for (std::size_t b = 0; b < shot.bodies.size(); ++b) {
    const SurfaceShot::Body& body = shot.bodies[b];
    const auto& x = body.positions_world_m;
    for (const Triangle& t : body.triangles) {
      if (!t.alive() || t.v[0] >= x.size() || t.v[1] >= x.size() || t.v[2] >= x.size()) continue;
      const Vec3 a = x[t.v[0]].cast<double>();
      const Vec3 ab = x[t.v[1]].cast<double>() - a, ac = x[t.v[2]].cast<double>() - a;
      const Vec3 p = ray.along_world.cross(ac);
      const double det = ab.dot(p);
      if (!(std::abs(det) > 1e-18)) continue;
      const Vec3 from_a = ray.from_world_m - a;
      const double u = from_a.dot(p) / det;
      if (u < 0 || u > 1) continue;
      const Vec3 q = from_a.cross(ab);
      const double v = ray.along_world.dot(q) / det;
      const double distance_m = ac.dot(q) / det;
      if (v < 0 || u + v > 1 || distance_m <= 0 || (nearest && distance_m >= nearest->distance_m)) continue;
      nearest =
          Hit{ray.from_world_m + distance_m * ray.along_world, ab.cross(ac).normalized(), t.surface, distance_m, b};
    }
  }
  return nearest;
}

std::optional<Hit> pick_beside(const Ray& ray, const SurfaceShot& shot, double within_m) {
  std::optional<Hit> nearest;
  for (std::size_t b = 0; b < shot.bodies.size(); ++b) {
    const auto& x = shot.bodies[b].positions_world_m;
    for (const Triangle& t : shot.bodies[b].triangles) {
      if (!t.alive() || t.surface != Surface::skin) continue;
      if (t.v[0] >= x.size() || t.v[1] >= x.size() || t.v[2] >= x.size()) continue;
      const Vec3 a = x[t.v[0]].cast<double>(), centre = (a + x[t.v[1]].cast<double>() + x[t.v[2]].cast<double>()) / 3;
      const Vec3 area = (x[t.v[1]].cast<double>() - a).cross(x[t.v[2]].cast<double>() - a);
      const double distance_m = ray.along_world.dot(centre - ray.from_world_m);
      const double aside_m = (centre - ray.from_world_m).cross(ray.along_world).norm();
      if (area.dot(ray.along_world) >= 0 || distance_m <= 0 || aside_m >= within_m) continue;
      within_m = aside_m;
      nearest = Hit{centre, area.normalized(), Surface::skin, distance_m, b};
    }
  }
  return nearest;
}

Vec3 mean_normal(const Hit& hit, const Ray& ray, const SurfaceShot& shot, double within_m) {
  const SurfaceShot::Body& body = shot.bodies[hit.body];
  const auto& x = body.positions_world_m;
  Vec3 sum = Vec3::Zero();
  for (const Triangle& t : body.triangles) {
    if (!t.alive() || t.surface != Surface::skin) continue;
    if (t.v[0] >= x.size() || t.v[1] >= x.size() || t.v[2] >= x.size()) continue;
    const Vec3 a = x[t.v[0]].cast<double>(), b = x[t.v[1]].cast<double>(), c = x[t.v[2]].cast<double>();
    const double nearness = 1 - ((a + b + c) / 3 - hit.point_world_m).squaredNorm() / (within_m * within_m);
    const Vec3 area = (b - a).cross(c - a);
    if (nearness > 0 && area.dot(ray.along_world) < 0) sum += nearness * area;
  }
  return sum.norm() > 0 ? sum.normalized() : hit.normal_world;
}

}  // namespace sectio

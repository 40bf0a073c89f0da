#include "render_client/page/pick.h"

#include <array>
#include <cmath>

namespace sectio {
namespace {

// The corners of a triangle; nothing if it isn't alive, or names a vertex that the shot hasn't.
std::optional<std::array<Vec3, 3>> corners_world_m(const SurfaceShot::Body& body, const Triangle& t) {
  const auto& x = body.positions_world_m;
  if (!t.alive() || t.v[0] >= x.size() || t.v[1] >= x.size() || t.v[2] >= x.size()) return std::nullopt;
  return std::array<Vec3, 3>{x[t.v[0]].cast<double>(), x[t.v[1]].cast<double>(), x[t.v[2]].cast<double>()};
}

// The same of skin that faces the eye.
struct Facing {
  Vec3 centre_world_m, normal_m2;  // the normal is twice as long as the area
};
std::optional<Facing> skin_facing(const Ray& ray, const SurfaceShot::Body& body, const Triangle& t) {
  const auto corners = t.surface == Surface::skin ? corners_world_m(body, t) : std::nullopt;
  if (!corners) return std::nullopt;
  const auto& [a, b, c] = *corners;
  const Vec3 normal_m2 = (b - a).cross(c - a);
  if (normal_m2.dot(ray.along_world) >= 0) return std::nullopt;
  return Facing{(a + b + c) / 3, normal_m2};
}

}  // namespace

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
    for (const Triangle& t : body.triangles) {
      const auto corners = corners_world_m(body, t);
      if (!corners) continue;
      const Vec3& a = (*corners)[0];
      const Vec3 ab = (*corners)[1] - a, ac = (*corners)[2] - a;
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
  for (std::size_t b = 0; b < shot.bodies.size(); ++b)
    for (const Triangle& t : shot.bodies[b].triangles) {
      const std::optional<Facing> skin = skin_facing(ray, shot.bodies[b], t);
      if (!skin) continue;
      const Vec3 from_eye_m = skin->centre_world_m - ray.from_world_m;
      const double distance_m = ray.along_world.dot(from_eye_m), aside_m = from_eye_m.cross(ray.along_world).norm();
      if (distance_m <= 0 || aside_m >= within_m) continue;
      within_m = aside_m;
      nearest = Hit{skin->centre_world_m, skin->normal_m2.normalized(), Surface::skin, distance_m, b};
    }
  return nearest;
}

Vec3 mean_normal(const Hit& hit, const Ray& ray, const SurfaceShot& shot, double within_m) {
  const SurfaceShot::Body& body = shot.bodies[hit.body];
  Vec3 sum = Vec3::Zero();
  for (const Triangle& t : body.triangles) {
    const std::optional<Facing> skin = skin_facing(ray, body, t);
    if (!skin) continue;
    const double nearness = 1 - (skin->centre_world_m - hit.point_world_m).squaredNorm() / (within_m * within_m);
    if (nearness > 0) sum += nearness * skin->normal_m2;
  }
  return sum.norm() > 0 ? sum.normalized() : hit.normal_world;
}

}  // namespace sectio

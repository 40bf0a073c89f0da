// The first thing that a line of sight hits.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "render_client/draw/orbit_camera.h"
#include "render_client/replica/frame.h"

namespace sectio {

struct Hit {
  Vec3 point_world_m = Vec3::Zero();
  Vec3 normal_world = Vec3::UnitZ();  // unit, out of the tissue
  Surface surface = Surface::skin;
  double distance_m = 0;
  std::size_t body = 0;
};

// The bodies' surfaces as they were at one moment.
struct SurfaceShot {
  struct Body {
    std::vector<Vec3f> positions_world_m;
    std::vector<Triangle> triangles;
  };
  std::vector<Body> bodies;
};
SurfaceShot shot_of(const Frame& frame);

// O(triangles). Triangles that are seen from behind count, too.
std::optional<Hit> pick(const Ray& ray, const SurfaceShot& shot);

// The skin that faces the eye next to a line of sight that passes it by at most `within_m`. O(triangles).
std::optional<Hit> pick_beside(const Ray& ray, const SurfaceShot& shot, double within_m);

// The mean normal of the skin that faces the eye within a distance of a hit, on the same body: unit. Near triangles and
// large ones count more. O(triangles).
Vec3 mean_normal(const Hit& hit, const Ray& ray, const SurfaceShot& shot, double within_m);

}  // namespace sectio

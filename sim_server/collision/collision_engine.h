// What a collision engine is to the simulation: it answers questions about where the surface of one body is.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "sim_server/collision/surface_view.h"
#include "sim_server/engine/engine.h"

namespace sectio {

struct ClosestSurfacePoint {
  TriangleId triangle = kNone;
  Vec3 bary = Vec3::Zero();
  Vec3 point_world_m = Vec3::Zero();
  double distance_m = 0;
};

// Queries are of the current surface, given as `view`; moved() must come between a change of positions and the next
// one. Queries are const and give their results in an order that follows from the surface alone.
class CollisionEngine : public Engine {
 public:
  virtual void moved(const SurfaceView& view) = 0;

  // Holds the current surface; may be a little larger.
  virtual Box3 bounds_world_m() const = 0;
  // Every crossing of the segment p q, in order of parameter.
  virtual std::vector<SurfaceHit> hits(const SurfaceView& view, const Vec3& p, const Vec3& q) const = 0;
  virtual std::optional<SurfaceHit> first_hit(const SurfaceView& view, const Vec3& p, const Vec3& q) const = 0;
  // Is the point inside the closed surface?
  virtual bool inside(const SurfaceView& view, const Vec3& point) const = 0;
  virtual std::optional<ClosestSurfacePoint> closest(const SurfaceView& view, const Vec3& point,
                                                     double within_m) const = 0;
  // Triangles whose current box, grown by reach_m, meets one of the segments between the points given; ascending.
  virtual void near_segments(const SurfaceView& view, std::span<const Vec3> points,
                             std::span<const std::array<std::size_t, 2>> segments, double reach_m,
                             std::vector<TriangleId>& out) const = 0;
};

}  // namespace sectio

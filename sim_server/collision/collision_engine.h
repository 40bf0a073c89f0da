// The interface of a collision engine: it answers geometric queries about the surface of one body.
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

// Queries are about the current surface, given as `view`; moved() must be called between a change of positions and the
// next query. Queries are const, and the order of their results depends on the surface alone.
class CollisionEngine : public Engine {
 public:
  virtual void moved(const SurfaceView& view) = 0;

  // A box that contains the current surface and may be a little larger.
  virtual Box3 bounds_world_m() const = 0;
  // Every crossing of the segment p q, in order of parameter.
  virtual std::vector<SurfaceHit> hits(const SurfaceView& view, const Vec3& p, const Vec3& q) const = 0;
  virtual std::optional<SurfaceHit> first_hit(const SurfaceView& view, const Vec3& p, const Vec3& q) const = 0;
  // Whether the point is inside the closed surface.
  virtual bool inside(const SurfaceView& view, const Vec3& point) const = 0;
  virtual std::optional<ClosestSurfacePoint> closest(const SurfaceView& view, const Vec3& point,
                                                     double within_m) const = 0;
  // Triangles whose current box, grown by reach_m, meets one of the segments between the given points; ascending.
  virtual void near_segments(const SurfaceView& view, std::span<const Vec3> points,
                             std::span<const std::array<std::size_t, 2>> segments, double reach_m,
                             std::vector<TriangleId>& out) const = 0;
};

}  // namespace sectio

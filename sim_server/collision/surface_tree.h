// A dynamic hierarchy of boxes over the triangles of one body, for global queries.
//
// Each leaf is a triangle slot in a fat box: the box of its corners' anchors, grown by a margin. The anchor of a vertex
// is the place where it last left the margin; while it stays within the margin, the tree doesn't change. Cost: a query
// O(log n + found), a delta of k triangles O(k log n), a scan of all vertices O(n).
//
// After the mesh or the positions change, the matching update must come before the next query. Positions must be
// finite. Queries are const, safe in several threads at once, and their results come in an order that does not depend
// on the shape of the tree.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sim_server/collision/collision_engine.h"

namespace sectio {

class SurfaceTree final : public CollisionEngine {
 public:
  static constexpr double kDefaultMargin_m = 0.0005;

  explicit SurfaceTree(const SurfaceView& view, double margin_m = kDefaultMargin_m);
  ~SurfaceTree() override;
  SurfaceTree(SurfaceTree&&) noexcept;
  SurfaceTree& operator=(SurfaceTree&&) noexcept;

  // Call after positions have changed, of all vertices or of those named. Returns how many vertices left their margin.
  std::size_t update_moved(const SurfaceView& view);
  std::size_t update_moved(const SurfaceView& view, std::span<const VertexId> moved);
  // Call after a delta, with the slots of added, changed and removed triangles in any order.
  void update_changed(const SurfaceView& view, std::span<const TriangleId> changed);

  std::size_t size() const;   // live triangles
  std::size_t depth() const;  // O(n); for tests

  void follow(const SharedBody& body, const TopologyChange& change) override;
  void moved(const SurfaceView& view) override { update_moved(view); }
  void archive(Archive& a, const SharedBody& body) override;
  Box3 bounds_world_m() const override;

  std::vector<SurfaceHit> hits(const SurfaceView& view, const Vec3& p, const Vec3& q) const override;
  std::optional<SurfaceHit> first_hit(const SurfaceView& view, const Vec3& p, const Vec3& q) const override;
  // Counts the crossings of a ray, whose parity is exact.
  bool inside(const SurfaceView& view, const Vec3& point) const override;
  std::optional<ClosestSurfacePoint> closest(const SurfaceView& view, const Vec3& point,
                                             double within_m) const override;
  // Crossings of the surface's edges with the surface that a moving segment sweeps.
  std::vector<EdgeCrossing> swept(const SurfaceView& view, const SweptSegment& sweep) const;

  void near_segments(const SurfaceView& view, std::span<const Vec3> points,
                     std::span<const std::array<std::size_t, 2>> segments, double reach_m,
                     std::vector<TriangleId>& out) const override;
  // Triangles whose current box overlaps the given box; ascending.
  void in_box(const SurfaceView& view, const Box3& box, std::vector<TriangleId>& out) const;

 private:
  struct Hierarchy;  // hides FCL
  std::unique_ptr<Hierarchy> hierarchy_;
};

}  // namespace sectio

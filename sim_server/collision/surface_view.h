// A body's surface as collision sees it, and the tests of its triangles one by one.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "sim_server/collision/contact.h"

namespace sectio {

// A surface as it is now; refers to the database, and is good until this changes.
struct SurfaceView {
  const TriangleMesh& mesh;
  std::span<const Vec3f> positions_world_m;  // one a vertex slot
  std::uint32_t body = 0;

  bool alive(TriangleId t) const { return t < mesh.triangle_slots() && mesh.triangle(t).alive(); }
  Vec3 corner(TriangleId t, std::size_t i) const { return positions_world_m[mesh.triangle(t).v[i]].cast<double>(); }
  Corners corners(TriangleId t) const { return {corner(t, 0), corner(t, 1), corner(t, 2)}; }
};

// One triangle against one segment.
std::optional<SurfaceHit> hit_triangle(const SurfaceView& view, TriangleId t, const Vec3& p, const Vec3& q);

// Ascending in parameter, then in triangle.
void sort_hits(std::vector<SurfaceHit>& hits);

// Crossings of the edges of `triangles` (ascending) with a sweep, in order of time, each edge once. `triangles` must
// hold the lower triangle at every edge that the sweep can reach.
std::vector<EdgeCrossing> cross_edges(const SurfaceView& view, std::span<const TriangleId> triangles,
                                      const SweptSegment& sweep);

// The box of everything that the segment is at, from before to after.
Box3 box_of(const SweptSegment& sweep);
Box3 box_of(const Corners& triangle);

// No point of the sweep is further than this from the segment a1 b1.
double reach_of(const SweptSegment& sweep);

}  // namespace sectio

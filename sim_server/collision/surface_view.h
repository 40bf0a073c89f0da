// A view of a body's surface for collision, and tests of single triangles.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "common/math/positions_view.h"
#include "sim_server/collision/contact.h"

namespace sectio {

// The present surface; refers to the mesh, and is valid until the mesh or the positions change.
struct SurfaceView {
  const TriangleMesh& mesh;
  PositionsView positions_world_m;  // one a vertex slot
  std::uint32_t body = 0;

  bool alive(TriangleId t) const { return t < mesh.triangle_slots() && mesh.triangle(t).alive(); }
  Vec3 corner(TriangleId t, std::size_t i) const { return positions_world_m[mesh.triangle(t).v[i]].cast<double>(); }
  Corners corners(TriangleId t) const { return {corner(t, 0), corner(t, 1), corner(t, 2)}; }
  // Unit, out of the body; zero when the triangle has no area.
  Vec3 normal(TriangleId t) const {
    const Corners c = corners(t);
    return (c[1] - c[0]).cross(c[2] - c[0]).stableNormalized();
  }
};

// Tests one triangle against one segment.
std::optional<SurfaceHit> hit_triangle(const SurfaceView& view, TriangleId t, const Vec3& p, const Vec3& q);

// Sorts by parameter, then by triangle.
void sort_hits(std::vector<SurfaceHit>& hits);

// Crossings of the edges of `triangles` (ascending) with a swept segment, in order of time, each edge once. `triangles`
// must contain the lower-numbered triangle at every edge that the segment can reach.
std::vector<EdgeCrossing> cross_edges(const SurfaceView& view, std::span<const TriangleId> triangles,
                                      const SweptSegment& sweep);

// The box that contains the segment from before to after its motion.
Box3 box_of(const SweptSegment& sweep);
Box3 box_of(const Corners& triangle);

// The largest distance of a point of the swept surface from the segment a1 b1.
double reach_of(const SweptSegment& sweep);

}  // namespace sectio

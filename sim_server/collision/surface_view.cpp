#include "sim_server/collision/surface_view.h"

#include <algorithm>
#include <tuple>

namespace sectio {

std::optional<SurfaceHit> hit_triangle(const SurfaceView& view, TriangleId t, const Vec3& p, const Vec3& q) {
  const Corners corners = view.corners(t);
  const auto c = cross_segment(p, q, corners);
  if (!c) return std::nullopt;
  const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
  return SurfaceHit{view.body, t, c->bary, c->point, normal, c->parameter, c->entering};
}

void sort_hits(std::vector<SurfaceHit>& hits) {
  std::sort(hits.begin(), hits.end(), [](const SurfaceHit& x, const SurfaceHit& y) {
    return std::tie(x.parameter, x.triangle) < std::tie(y.parameter, y.triangle);
  });
}

std::vector<EdgeCrossing> cross_edges(const SurfaceView& view, std::span<const TriangleId> triangles,
                                      const SweptSegment& sweep) {
  std::vector<EdgeCrossing> found;
  const Box3 reached = box_of(sweep);
  for (const TriangleId t : triangles) {
    const Corners corners = view.corners(t);
    for (std::size_t i = 0; i < 3; ++i) {
      if (view.mesh.neighbours(t)[i] < t) continue;
      const Vec3 &p = corners[i], &q = corners[(i + 1) % 3];
      if ((p.array().max(q.array()) < reached.min().array()).any() ||
          (p.array().min(q.array()) > reached.max().array()).any())
        continue;
      const SweptCrossings crossings = cross_swept(p, q, sweep);
      for (int k = 0; k < crossings.count; ++k) {
        const SweptCrossing& c = crossings.at[static_cast<std::size_t>(k)];
        found.push_back({t, static_cast<int>(i), c.edge_parameter, c.time, c.along, c.point});
      }
    }
  }
  std::sort(found.begin(), found.end(), [](const EdgeCrossing& x, const EdgeCrossing& y) {
    return std::tie(x.time, x.triangle, x.edge) < std::tie(y.time, y.triangle, y.edge);
  });
  return found;
}

Box3 box_of(const SweptSegment& sweep) {
  Box3 box(sweep.a0);
  return box.extend(sweep.b0).extend(sweep.a1).extend(sweep.b1);
}

Box3 box_of(const Corners& triangle) {
  Box3 box(triangle[0]);
  return box.extend(triangle[1]).extend(triangle[2]);
}

// Each point of the swept surface is a1 + s (b1 - a1) minus a convex combination of the two ends' motions.
double reach_of(const SweptSegment& sweep) {
  return std::max((sweep.a1 - sweep.a0).norm(), (sweep.b1 - sweep.b0).norm());
}

}  // namespace sectio

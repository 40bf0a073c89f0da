// The results of a collision engine as plain values: facts, no decisions. Intersection points are computed here once,
// and cutting uses them unchanged.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/math/intersect.h"
#include "common/mesh/triangle_mesh.h"

namespace sectio {

// A segment passes through a triangle.
struct SurfaceHit {
  std::uint32_t body = 0;
  TriangleId triangle = kNone;
  Vec3 bary = Vec3::Zero();
  Vec3 point_world_m = Vec3::Zero();  // bary applied to the current corners
  Vec3 normal_world = Vec3::Zero();   // unit, outwards
  double parameter = 0;               // along the segment, 0 to 1
  bool entering = false;              // from the outside to the inside
};

// An edge of the surface crosses the surface swept by a moving segment. In order of time, these crossings are the
// corners of the segment's path over the surface, between the triangle that it pierced before and the one that it
// pierces after.
struct EdgeCrossing {
  TriangleId triangle = kNone;  // the lower of the two triangles at the edge
  int edge = 0;                 // an edge of `triangle`: v[edge] -> v[(edge + 1) % 3]
  double edge_parameter = 0;    // 0 at v[edge]
  double time = 0;              // 0 before, 1 after
  double along = 0;             // on the moving segment, 0 at its first point
  Vec3 point_world_m = Vec3::Zero();
};

// The instrument's corner points (paper B, figure 3), in the world.
struct ToolCorners {
  std::array<Vec3, 4> at_world_m;  // A, B, C, D
};
enum class ToolCorner : std::uint8_t { a, b, c, d };

enum class ToolSegment : std::uint8_t { ab, ac, bd, cd };
constexpr std::size_t kToolSegments = 4;
constexpr std::array<std::array<std::size_t, 2>, kToolSegments> kSegmentCorners{{{0, 1}, {0, 2}, {1, 3}, {2, 3}}};

struct SegmentContact {
  std::vector<SurfaceHit> before;   // hits of the segment's last place with the present surface
  std::vector<SurfaceHit> after;    // hits of its present place, from A (AB, AC), B (BD) or C (CD) on
  std::vector<EdgeCrossing> swept;  // in order of time
};

struct ToolContact {
  std::array<SegmentContact, kToolSegments> segments;
  std::array<std::vector<SurfaceHit>, 4> corner_paths;  // hits of the paths of A, B, C, D, in order of parameter
  bool searched_globally = false;

  const SegmentContact& operator[](ToolSegment s) const { return segments[static_cast<std::size_t>(s)]; }
  const std::vector<SurfaceHit>& path(ToolCorner c) const { return corner_paths[static_cast<std::size_t>(c)]; }
  // Whether there is any hit or crossing.
  bool touches() const;
};

}  // namespace sectio

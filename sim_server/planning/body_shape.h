// The shape of a body as a planner needs it, measured on the surface. Pure functions.
#pragma once

#include <optional>

#include "common/mesh/triangle_mesh.h"

namespace sectio::planning {

struct BodyShape {
  double volume_m3 = 0;
  double thickness_m = 0;  // median over the surface of the depth of tissue beneath it
  Vec3 size_m = Vec3::Zero();
  double edge_m = 0;  // mean edge of its triangles
  std::size_t vertices = 0;
  bool sharp_edges = false;  // enough sharp edges to matter for bending
  bool is_box = false;       // it fills its bounding box
};

// `surface`: closed and oriented. O(triangles).
BodyShape shape_of(const TriangleSoup& surface);

constexpr double kOnCells = 0.01;  // tolerance, in cells, of a face on faces of cells

// Whether the body is a box whose smallest side is a multiple of the cell. Then its faces lie on faces of cells, except
// perhaps at the far end of the longer sides.
bool lies_on_cells(const BodyShape& shape, double cell_m);

// The part of a straight line in the body.
struct Chord {
  double enters = 0, leaves = 0;  // first and last crossing, from the origin in lengths of direction
};
std::optional<Chord> chord(const TriangleSoup& surface, const Vec3& origin, const Vec3& direction);

}  // namespace sectio::planning

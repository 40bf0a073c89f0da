// What a planner has to know of a body's form, measured on its surface. Pure functions.
#pragma once

#include <optional>

#include "common/mesh/triangle_mesh.h"

namespace sectio::planning {

struct BodyShape {
  double volume_m3 = 0;
  double thickness_m = 0;  // half of the surface has less tissue beneath it than this, measured inwards
  Vec3 size_m = Vec3::Zero();
  double edge_m = 0;  // of its triangles, in the mean
  std::size_t vertices = 0;
  bool sharp_edges = false;  // enough of them to matter for how it bends
  bool is_box = false;       // it is the box around it
};

// `surface`: closed and oriented. O(triangles).
BodyShape shape_of(const TriangleSoup& surface);

// Does a box's smallest side take whole cells? Then its faces lie on those of cells, but for what is left over at the
// far end of the longer sides. Not for other bodies.
bool lies_on_cells(const BodyShape& shape, double cell_m);

// What a straight line has in the body, from where it comes in.
struct Chord {
  double enters = 0, leaves = 0;  // along the line from its origin, in lengths of direction; the first and the last
};
std::optional<Chord> chord(const TriangleSoup& surface, const Vec3& origin, const Vec3& direction);

}  // namespace sectio::planning

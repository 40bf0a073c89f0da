// A patch is a set of triangle slots whose contents change together. link_patch() finds the adjacency across and around
// it: the one piece of code by which meshes and drafts of meshes stay closed.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "common/mesh/triangle_mesh.h"

namespace sectio {

struct PatchTriangle {
  TriangleId id = kNone;
  Triangle before;  // dead when the slot is new
  std::array<TriangleId, 3> neighbours_before{kNone, kNone, kNone};
  Triangle after;  // dead when the slot is freed
};

// Across the edge that starts at `from`, triangle `triangle` now meets `neighbour`.
struct Link {
  TriangleId triangle = kNone;
  VertexId from = kNone;
  TriangleId neighbour = kNone;
};

// `patch` in ascending order of id. Fills `links` for the patch and for the triangles around it. False, with `links`
// unspecified, when the triangles after do not fill exactly the hole that the triangles before leave.
bool link_patch(std::span<const PatchTriangle> patch, std::vector<Link>& links);

}  // namespace sectio

// A patch is a set of triangle slots whose contents change together. link_patch() finds the adjacency in it and around
// it, for meshes and for drafts of meshes, and so keeps both closed.
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

// The new neighbour of a triangle across its edge that starts at `from`.
struct Link {
  TriangleId triangle = kNone;
  VertexId from = kNone;
  TriangleId neighbour = kNone;
};

// `patch` must ascend in id. Fills `links` for the patch and for the triangles around it. False, with `links`
// unspecified, when the triangles after the change do not exactly fill the hole that the triangles before it leave.
bool link_patch(std::span<const PatchTriangle> patch, std::vector<Link>& links);

}  // namespace sectio

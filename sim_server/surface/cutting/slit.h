// Opens one region of a cut: its surface points become pairs, and two walls with a bottom between them close the hole
// (paper A, figures 8 to 14). This is the only topological operation of the template style; it works on a draft.
#pragma once

#include <utility>
#include <vector>

#include "sim_server/surface/cutting/mesh_draft.h"
#include "sim_server/surface/cutting/sweep_path.h"

namespace sectio {

// A corner of the region.
struct SlitNode {
  VertexId left = kNone, right = kNone;  // the same vertex where the slit ends
  Vec2 at = Vec2::Zero();                // in the plane of the sweep
  bool on_surface = false;
  bool bottom_follows = false;  // the edge to the next node is on the trail: bottom faces along it
  // For an old vertex that becomes a pair: the path through it, from a neighbour to a neighbour. The vertex's triangles
  // to the right of that path get the right half.
  VertexId path_from = kNone, path_to = kNone;

  bool pair() const { return left != right; }
};

struct Slit {
  std::vector<SlitNode> rim;                                   // clockwise in the plane of the sweep
  std::vector<std::pair<std::size_t, std::size_t>> verticals;  // edges between rim nodes that the walls must have
  std::vector<Triangle> old_bottoms;                           // to remove
  std::vector<Triangle> new_bottoms;                           // replacements, with the vertices after opening
};

// The draft has the vertices already, with both halves of each pair, and the path along the surface consists of edges.
// False when the result would not be closed, oriented and manifold; the draft must then be dropped.
[[nodiscard]] bool open_slits(MeshDraft& draft, std::span<const Slit> slits);

}  // namespace sectio

// Opening one region of a cut: its surface points become pairs, two walls and the bottom between them close the hole
// (paper A, figures 8 to 14). The one topological operation of the template style, on a draft.
#pragma once

#include <utility>
#include <vector>

#include "sim_server/surface/cutting/mesh_draft.h"
#include "sim_server/surface/cutting/sweep_path.h"

namespace sectio {

// A corner of the region.
struct SlitNode {
  VertexId left = kNone, right = kNone;  // the same one where the slit ends
  Vec2 at = Vec2::Zero();                // in the plane of the sweep
  bool on_surface = false;
  bool bottom_follows = false;  // the edge to the next node is on the trail: bottom faces along it
  // Of a vertex that was there before and becomes a pair: the path through it, from a neighbour to a neighbour.
  // Its triangles to the right of that path get the right half.
  VertexId path_from = kNone, path_to = kNone;

  bool pair() const { return left != right; }
};

struct Slit {
  std::vector<SlitNode> rim;                                   // clockwise in the plane of the sweep
  std::vector<std::pair<std::size_t, std::size_t>> verticals;  // of the rim: edges that the walls must have
  std::vector<Triangle> old_bottoms;                           // discarded
  std::vector<Triangle> new_bottoms;                           // in their place, in ids after opening
};

// Vertices are there already, the path along the surface is one of edges, and pairs have both halves. False, and the
// draft is not to be used any more, when the result would not be closed, oriented and manifold.
[[nodiscard]] bool open_slits(MeshDraft& draft, std::span<const Slit> slits);

}  // namespace sectio

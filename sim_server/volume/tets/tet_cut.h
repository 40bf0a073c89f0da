// Cuts a volume of tetrahedra along a flat sheet by splitting the edges that it crosses (methods 4.2).
//
//   1  edges whose ends lie on different sides of the sheet's plane and which it crosses inside its outline
//   2  a crossing close to an end of its edge is moved there: the cut goes to the vertex, not the vertex to the cut
//   3  the other edges are split where they cross, in ascending order of their ends. A tetrahedron of which three edges
//      are crossed becomes 4, of which four are, 6; neighbours see the same splits, so that all faces match
//   4  at a side of the outline where the cut is to end exactly: elements that the sheet enters are split as if it went
//      on to where it leaves them; then what lies on the sheet, edges between vertices of 2 and 3, is split where that
//      side crosses it, in the same way
//   5  faces whose three corners lie on the sheet, with a tetrahedron on each side, are cut
//   6  each vertex on the sheet gets a twin for every further component that its tetrahedra fall into when cut faces no
//      longer connect them: the parts separate, and the tip of a cut that ends inside stays closed
//
// Cuts through earlier cuts, along them, through vertices and edges need no case of their own. Deterministic.
#pragma once

#include "sim_server/volume/tets/tet_topology.h"

namespace sectio {

// A flat convex piece of the surface that a blade has swept, in the world. Corners in order around it, three or more.
struct CutSheet {
  std::vector<Vec3> outline_world_m;
  // Vertices of a cut that this sheet goes on from: on the sheet, too, wherever they are.
  std::vector<VertexId> joined = {};
  // Sides of the outline, side i from corner i to the next, at which the cut is to end where they are, inside elements:
  // bit i. At the others it ends with the last edges that the sheet crosses. And those of these at which it is to end
  // only to a quarter of an edge, for the sake of the elements there, as they are to stay.
  std::uint32_t exact = 0, lasting = 0;
};

struct TetCutSettings {
  // Crossings within this fraction of an edge from an end go there. Between 0.05 and 0.1 the step that was stable
  // before stays so at the cost of little added mass; above 0.15 crumbs come off.
  double snap = 0.08;
  // Paper C's rule: only tetrahedra that are cut through are cut. Else the cut follows the sheet into the element in
  // which it ends, as far as that one's crossed edges.
  bool semi_progressive = false;
  // Once blades are out, edges below this part of the mean edge around them go (collapse_onto()); 0: none.
  double collapse_ratio = 0.15;
};

struct TetCutOutcome {
  std::uint32_t crossed = 0;  // tetrahedra with a crossed edge
  std::uint32_t made = 0;     // tetrahedra in place of these and their neighbours, net
  std::uint32_t splits = 0, snapped = 0, twins = 0;
  std::vector<VertexId> on_sheet;  // vertices of the cut, twins included; ascending
  double ahead_m = 0;              // where it is exact: how far elements that it enters go on beyond it, at most
  std::uint32_t beyond = 0;  // sides of the outline beyond which elements go on that the sheet enters, if any is exact
  bool changed() const { return splits + twins > 0; }
};

// `begin`: tetrahedra to begin the search at, the sheet is followed from there through all that it crosses; empty: it
// is looked for everywhere, O(n). Otherwise O(cut).
TetCutOutcome cut(TetTopology& volume, const CutSheet& sheet, const TetCutSettings& settings,
                  std::span<const std::uint32_t> begin = {});

}  // namespace sectio

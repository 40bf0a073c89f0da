// Cuts a volume of tetrahedra along a sheet by splitting the edges that the sheet crosses, and snapping crossings
// near vertices to these.
//
//   1  find the edges whose ends lie on different sides of the sheet's plane and which it crosses inside its outline
//   2  move a crossing close to an end of its edge, or next to an end close to the sheet, to that vertex: the cut
//      moves, the vertex doesn't
//   3  split the other edges at their crossings, in ascending order of their ends. A tetrahedron with three crossed
//      edges becomes 4, one with four 6; neighbours see the same splits, so that all faces match
//   4  at a side of the outline where the cut is to end exactly: split the elements that the sheet enters as if it went
//      on through them; then split the edges on the sheet, between vertices of 2 and 3, where that side crosses them,
//      in the same way
//   5  cut the faces whose three corners lie on the sheet and which have a tetrahedron on each side
//   6  a crumb that would come off stays on the other side of the sheet: its other faces are open, so it holds nothing
//      together
//   7  give each vertex on the sheet a twin for every further component of its tetrahedra when cut faces no longer
//      connect them: the parts separate, and the tip of a cut that ends inside stays closed
//
// Cuts through or along earlier cuts, and through vertices and edges, are no special cases. Deterministic.
#pragma once

#include "sim_server/volume/tets/sheet_shape.h"
#include "sim_server/volume/tets/tet_topology.h"

namespace sectio {

struct TetCutSettings {
  // A crossing within this fraction of an edge from its end is moved there. Between 0.05 and 0.1 the step stays stable
  // at the cost of little added mass; above 0.15 crumbs come off.
  double snap = 0.08;
  // Paper C's rule: only tetrahedra that the sheet cuts through are cut. Otherwise the cut follows the sheet into the
  // element in which it ends, up to that element's crossed edges.
  bool semi_progressive = false;
  // A part smaller than this would come off as a crumb; 0: none would.
  double crumb_m3 = 0;
  // When no blade is in the tissue, edges with a smaller ratio are collapsed (collapse_onto()); 0: none is.
  double collapse_ratio = 0.15;
  // A crossing at an end this close to the sheet is moved there, too. Sheets that nearly coincide, as those of a blade
  // that goes slowly through a thread, would cut what each of them has made again and again.
  double close_m = 0;
};

struct TetCutOutcome {
  std::uint32_t crossed = 0;  // tetrahedra with a crossed edge
  std::uint32_t made = 0;     // increase of the number of tetrahedra
  std::uint32_t splits = 0, snapped = 0, twins = 0;
  std::vector<VertexId> on_sheet;  // vertices of the cut, twins included; ascending
  double ahead_m = 0;              // how far elements that the sheet enters extend beyond its exact sides, at most
  std::uint32_t beyond = 0;        // sides beyond which such elements extend, if any side is exact
  bool changed() const { return splits + twins > 0; }
};

// `begin`: the search for crossed tetrahedra starts from these and follows the sheet, O(cut); empty: it looks at all
// tetrahedra, O(n).
TetCutOutcome cut(TetTopology& volume, const CutSheet& sheet, const TetCutSettings& settings,
                  std::span<const std::uint32_t> begin = {});

}  // namespace sectio

// Cuts a volume of tetrahedra along a flat sheet by splitting the edges that it crosses (methods 4.2).
//
//   1  edges whose ends lie on different sides of the sheet's plane and which it crosses inside its outline
//   2  a crossing close to an end of its edge is moved to that end: the cut goes to the vertex, not the vertex to the
//   cut 3  the other edges are split where they cross, in ascending order of their ends. A tetrahedron of which three
//   edges
//      are crossed becomes 4, of which four are, 6; neighbours see the same splits, so that all faces match
//   4  faces whose three corners lie on the sheet, with a tetrahedron on each side, are cut
//   5  each vertex on the sheet gets a twin for every further component that its tetrahedra fall into when cut faces no
//      longer connect them: the parts separate, and the tip of a cut that ends inside stays closed
//
// Cuts through earlier cuts, along them, through vertices and edges need no case of their own. Deterministic.
#pragma once

#include "sim_server/tet_cutting/tet_topology.h"

namespace sectio {

// A flat convex piece of the surface that a blade has swept, in the world. Corners in order around it, three or more.
struct CutSheet {
  std::vector<Vec3> outline_world_m;
  // Vertices of a cut that this sheet goes on from: on the sheet, too, wherever they are.
  std::vector<VertexId> joined = {};
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
  bool changed() const { return splits + twins > 0; }
};

// `begin`: tetrahedra to begin the search at, the sheet is followed from there through all that it crosses; empty: it
// is looked for everywhere, O(n). Otherwise O(cut).
TetCutOutcome cut(TetTopology& volume, const CutSheet& sheet, const TetCutSettings& settings,
                  std::span<const std::uint32_t> begin = {});

// A blade on its way: its edge is given again and again, and the cut always reaches to where it is. What is opened is
// temporary while the sheet since the last settled place stays flat: it is undone exactly and made again, larger.
class TetStroke {
 public:
  explicit TetStroke(const TetCutSettings& settings) : settings_(settings) {}

  // The blade's edge is at a b now.
  TetCutOutcome advance(TetTopology& volume, const Vec3& a_world_m, const Vec3& b_world_m);
  // The cut stays as it is.
  void finish() { started_ = false; }

 private:
  TetCutSettings settings_;
  bool started_ = false;
  Vec3 from_a_, from_b_;  // the settled edge
  Vec3 last_a_, last_b_;
  std::size_t mark_ = 0;
  std::vector<VertexId> settled_, last_;  // vertices of the cut up to the settled edge, and of the sheet from there
};

}  // namespace sectio

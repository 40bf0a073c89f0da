// Subdivision templates of progressive cutting on a surface (paper B, sections 4 and 5), on a draft.
//
// All templates are made of two operations that keep a closed manifold closed, whatever surrounds them: inserting a
// vertex (into a face, on an edge, or in the middle of a cell), and unzipping, which opens the path a - v - b along two
// edges of one vertex and fills the hole. The surface may therefore be skin, the wall of an older groove, or the lip
// between the two.
#pragma once

#include <array>
#include <vector>

#include "sim_server/surface/cutting/mesh_draft.h"

namespace sectio {

// The part of the fan around `apex` that contains the instrument: the triangles (apex, rim[i], rim[i+1]). It is one
// triangle if the cut ends at a vertex. It is two if the cut came over an edge: together they are the triangle rim[0],
// rim[1], rim[2], and apex is the point on its edge rim[2] - rim[0].
struct Cell {
  VertexId apex = kNone;
  std::vector<VertexId> rim;  // counter-clockwise, two or three

  // The flat triangle to which barycentric coordinates in the cell refer.
  std::array<VertexId, 3> corners() const {
    return rim.size() == 3 ? std::array{rim[0], rim[1], rim[2]} : std::array{apex, rim[0], rim[1]};
  }

  template <class A>
  void archive(A& a) {
    a(apex, rim);
  }
};

// The triangles of a cell; empty if one of them doesn't exist (any more).
std::vector<TriangleId> triangles_of(const MeshDraft& draft, const Cell& cell);

//            A                     A
//           / \                   /|\       1 -> 3
//          /   \       =>        / N \      kNone on failure
//         B-----C               B-----C
VertexId insert_in_face(MeshDraft& draft, TriangleId t, const VertexState& state);

//            A                     A
//           / \                   /|\       2 -> 4; the new vertex lies on from -> to
//       from---to      =>     from-N-to
//           \ /                   \|/
//            X                     X
VertexId insert_on_edge(MeshDraft& draft, VertexId from, VertexId to, const VertexState& state);

// Inserts a vertex inside a cell and joins it to the whole rim and to the apex (figure 9): a cell of two triangles
// becomes four, one of one triangle three.
VertexId insert_in_cell(MeshDraft& draft, const Cell& cell, const VertexState& state);

// The triangles to the right of the path a - v - b along two edges, seen from outside: around v from the edge v - a
// counter-clockwise to the edge v - b. Empty if one of the edges is missing.
std::vector<TriangleId> right_of_path(const MeshDraft& draft, VertexId a, VertexId v, VertexId b);

// The first opening of a cut (figure 5), along the path start - middle - tip of two edges. `middle` becomes a pair
// (V2, V3 of the paper), and a groove of eight triangles closes the hole:
//
//      start ------- middle_left ------- tip         surface
//        | \          / |  \             |
//        |   \      /   |     \          |           left wall (the right one mirrors it)
//      bottom[0] -- bottom[1] ------- bottom[2]      bottom of the groove
struct Opening {
  VertexId twin = kNone;  // the right half of the vertex that was opened; the left half keeps its slot
  std::array<VertexId, 3> bottom{kNone, kNone, kNone};
};
std::optional<Opening> open_start(MeshDraft& draft, VertexId start, VertexId middle, VertexId tip,
                                  const std::array<VertexState, 3>& bottom);

// The next opening of a cut (figure 6): the path tip_bottom - tip - next. `tip` becomes a pair (V3, V4), four groove
// triangles reach down to a new bottom under `next`.
struct Extension {
  VertexId twin = kNone;
  VertexId bottom = kNone;
};
std::optional<Extension> extend(MeshDraft& draft, VertexId tip, VertexId tip_bottom, VertexId next,
                                const VertexState& bottom);

// Two grooves that end at the same vertex become one (figure 13): v is split (V1, V1') along bottom_a - v - bottom_b,
// and two triangles close the groove beneath. Returns the twin; kNone on failure.
VertexId join_grooves(MeshDraft& draft, VertexId v, VertexId bottom_a, VertexId bottom_b);

}  // namespace sectio

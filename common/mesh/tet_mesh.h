// The topology of a body's inside: tetrahedra over shared vertices. Plain data; whoever changes it keeps it valid.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "common/mesh/triangle_mesh.h"

namespace sectio {

// Corners a b c d with (b - a) x (c - a) . (d - a) > 0 at rest.
using Tetrahedron = std::array<VertexId, 4>;

struct TetMesh {
  std::vector<Vec3> vertices_body_m;  // at rest
  std::vector<Tetrahedron> tetrahedra;
};

// Corners of what is not there.
constexpr Tetrahedron kNoTetrahedron{kNone, kNone, kNone, kNone};

// What a change makes of one tetrahedron; kNoTetrahedron where it is not there.
struct TetEdit {
  std::uint32_t id = kNone;
  Tetrahedron before = kNoTetrahedron, after = kNoTetrahedron;
  std::uint32_t origin = kNone;  // that it was cut out of; itself when it was there before
};

// A change of a volume as those follow it who keep data beside it. Vertices and tetrahedra keep their numbers as long
// as they are there, what is gone leaves its number unused. What is new has the next ones; or those of what was
// temporary, which then may be elsewhere.
struct TetChange {
  VertexId first_added = 0;
  std::vector<Vec3> added_body_m;   // vertices from there on, at rest
  std::vector<std::uint8_t> fixed;  // of these, as VolumeSettings::fixed; empty: none
  std::vector<TetEdit> tetrahedra;  // ascending; some are what they were, where only their neighbours or places are not
};

// What leads from what `a` leads to, to what `b` does, both from the same volume. O(changes). Origins are those of b,
// or the tetrahedron itself.
TetChange between(const TetChange& a, const TetChange& b);

void follow(TetMesh& mesh, const TetChange& change);

// The faces of a tetrahedron, each seen counter-clockwise from outside; face i is opposite corner i.
constexpr std::array<std::array<std::size_t, 3>, 4> kTetFaces = {{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};
constexpr std::array<std::array<std::size_t, 2>, 6> kTetEdges = {{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};

inline double tet_volume_m3(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  return (b - a).cross(c - a).dot(d - a) / 6;
}
inline double tet_volume_m3(const TetMesh& mesh, const Tetrahedron& t) {
  const auto& x = mesh.vertices_body_m;
  return tet_volume_m3(x[t[0]], x[t[1]], x[t[2]], x[t[3]]);
}

// Each edge as often as there are tetrahedra that have it.
double mean_edge_m(const TetMesh& mesh);

// The faces that belong to one tetrahedron only, outside outward, in the order of the tetrahedra.
struct TetSurface {
  TriangleSoup soup;                // only vertices of the surface, ascending in their number in the volume
  std::vector<VertexId> of_volume;  // soup's vertex -> the volume's
};
TetSurface surface_of(const TetMesh& mesh);

struct TetReport {
  bool valid = true;           // all of check()'s demands
  bool conforming = true;      // all but that on the surface, which may touch itself in a vertex or an edge after cuts
  std::uint32_t vertices = 0;  // that a tetrahedron uses
  std::uint32_t tetrahedra = 0;
  std::uint32_t components = 0;  // connected through faces
  double volume_m3 = 0;
  double smallest_dihedral_deg = 0;
  std::string first_defect;  // empty when valid: what and where, for a person
};

// Positions finite, corners in range and distinct, volumes positive, each face in at most two tetrahedra and from
// opposite sides, the surface closed and manifold, no vertex unused. O(n log n).
TetReport check(const TetMesh& mesh);

}  // namespace sectio

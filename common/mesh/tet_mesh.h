// The topology of a body's inside: tetrahedra over shared vertices. Plain data: its owner must keep it valid.
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

  template <class A>
  void archive(A& a) {
    a(vertices_body_m, tetrahedra);
  }
};

// The corners of a tetrahedron that doesn't exist.
constexpr Tetrahedron kNoTetrahedron{kNone, kNone, kNone, kNone};

inline bool has(const Tetrahedron& t, VertexId v) {
  return t[0] == v || t[1] == v || t[2] == v || t[3] == v;
}

// The change of one tetrahedron; kNoTetrahedron before or after the change if it doesn't exist then.
struct TetEdit {
  std::uint32_t id = kNone;
  Tetrahedron before = kNoTetrahedron, after = kNoTetrahedron;
  std::uint32_t origin = kNone;  // the tetrahedron that it was cut out of; itself if it existed before

  template <class A>
  void archive(A& a) {
    a(id, before, after, origin);
  }
};

// A change of a volume, for data kept beside it. Vertices and tetrahedra keep their numbers as long as they exist, and
// the number of one that is removed stays unused. New ones get the next numbers, or those of temporary ones that the
// change replaces; the places of such vertices may differ.
struct TetChange {
  VertexId first_added = 0;
  std::vector<Vec3> added_body_m;   // vertices from first_added on, at rest
  std::vector<std::uint8_t> fixed;  // one for each added vertex, as VolumeSettings::fixed; empty: none is fixed
  std::vector<TetEdit> tetrahedra;  // ascending; before == after where only neighbours or places have changed
};

// The change that turns the result of a into the result of b; a and b are changes of the same volume. O(changes).
// Origins are those of b, or the tetrahedron itself.
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

// The linear shape functions of a tetrahedron at rest.
struct TetShape {
  std::array<Vec3, 4> gradient;  // 1/m
  double volume_m3 = 0;
};
TetShape tet_shape(const TetMesh& mesh, const Tetrahedron& t);

// The mean over the edges of all tetrahedra: an edge counts as often as it has tetrahedra.
double mean_edge_m(const TetMesh& mesh);

// The faces that belong to one tetrahedron only, oriented outwards, in the order of the tetrahedra.
struct TetSurface {
  TriangleSoup soup;                // only vertices of the surface, in the order of their numbers in the volume
  std::vector<VertexId> of_volume;  // a vertex of the soup -> its number in the volume
};
TetSurface surface_of(const TetMesh& mesh);

struct TetReport {
  bool valid = true;           // meets all of check()'s demands
  bool conforming = true;      // the same, but after cuts the surface may touch itself in a vertex or edge
  std::uint32_t vertices = 0;  // used by a tetrahedron
  std::uint32_t tetrahedra = 0;
  std::uint32_t components = 0;  // connected through faces
  double volume_m3 = 0;
  double smallest_dihedral_deg = 0;
  std::string first_defect;  // empty when valid: what and where, for a person
};

// Demands that positions are finite, corners are in range and distinct, volumes are positive, each face is in at most
// two tetrahedra and seen from opposite sides, the surface is closed and manifold, and no vertex is unused. O(n log n).
TetReport check(const TetMesh& mesh);

}  // namespace sectio

// Tetrahedra from a closed surface: a body-centred cubic lattice whose boundary is fitted to the surface (isosurface
// stuffing, Labelle and Shewchuk 2007). Inside, every element is the same and none locks as Kuhn's six to a cube do.
//
//   lattice         corners of cubes and their centres; a tetrahedron is an edge between two neighbouring centres and
//                   an edge of the square between them
//   inside?         parity of exact crossings along the lattice's edges, so that all edges agree
//   warp            a vertex close to where one of its edges crosses moves there: no tiny elements
//   split           the crossed edges that are left are bisected where they cross, all in one order, long ones first;
//                   what lies outside is dropped. Neighbours see the same bisections: the faces match by construction
//   settle          the lightest boundary vertices limit an explicit step; see settle()
#pragma once

#include "common/mesh/tet_mesh.h"

namespace sectio {

// The edge of the lattice's cubes that gives about so many tetrahedra in a volume: 12 a cube.
double cell_for_tetrahedra(double volume_m3, double tetrahedra);

// `surface`: closed, oriented, without self-intersection. The result passes check() (common/mesh/tet_mesh.h), its
// boundary vertices lie on the surface. Throws InputError when the surface is thinner than the cells can follow, or
// needs more than 5 million lattice points.
TetMesh fill_with_lattice(const TriangleSoup& surface, double cell_m);

}  // namespace sectio

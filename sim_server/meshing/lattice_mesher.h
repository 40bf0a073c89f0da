// Tetrahedra from a closed surface: a body-centred cubic lattice whose boundary is fitted to the surface (isosurface
// stuffing, Labelle and Shewchuk 2007). Inside, all elements are congruent, and none locks as Kuhn's six to a cube do.
//
//   lattice         corners of cubes and their centres; a tetrahedron is an edge between two neighbouring centres and
//                   an edge of the square between them
//   inside?         parity of exact crossings along the lattice's edges, so that all edges agree
//   warp            a vertex close to a crossing on one of its edges moves there, which avoids tiny elements
//   split           the remaining crossed edges are bisected at their crossings, all in one order, long ones first, and
//                   tetrahedra outside are dropped. Neighbours see the same bisections, so their faces match
//   relax           the lightest boundary vertices limit an explicit step; see relax()
#pragma once

#include "common/mesh/tet_mesh.h"
#include "sim_server/meshing/relax.h"

namespace sectio {

// The edge of the lattice's cubes for which a volume has about that many tetrahedra: 12 a cube.
double cell_for_tetrahedra(double volume_m3, double tetrahedra);

// `surface` must be closed, oriented and without self-intersection. The result passes check() (common/mesh/tet_mesh.h),
// and its boundary vertices lie on the surface. Throws InputError when the surface is too thin for the cells or needs
// more than 5 million lattice points. `relaxes`: see relax().
TetMesh fill_with_lattice(const TriangleSoup& surface, double cell_m, const RelaxWhere& relaxes = {});

}  // namespace sectio

// Boxes of tetrahedra for tests, and their vertices as particles.
#pragma once

#include <vector>

#include "common/mesh/tet_mesh.h"

namespace sectio::test {

// five: five tetrahedra in each cube, mirrored from cube to cube; kuhn: six in each, which locks.
enum class BoxLattice { five, kuhn };

// nx x ny x nz cubes with one corner at the origin. Vertices are in the order of x, then y, then z (fastest).
TetMesh tet_box(int nx, int ny, int nz, const Vec3& size_m, BoxLattice lattice = BoxLattice::five);

// Moves every vertex by up to `by_m` along each axis, reproducibly.
void jitter(TetMesh& mesh, double by_m);

// One entry for each vertex; the fourth number is not used.
using Points = std::vector<Vec4f>;
Points at_rest(const TetMesh& mesh);
Points still(const Points& x);

}  // namespace sectio::test

// Runs TetGen as a separate program, if it is installed, so that its licence and its crashes don't concern this one.
#pragma once

#include "common/mesh/tet_mesh.h"

namespace sectio {

bool tetgen_installed();

// `surface` as for fill_with_lattice(); its triangles are kept. Tetrahedra have at most largest_m3. Throws InputError
// if the program is not installed, fails, takes longer than limit_s or returns tetrahedra that don't pass check().
// Works in a temporary directory of its own, which is removed.
TetMesh fill_with_tetgen(const TriangleSoup& surface, double largest_m3, double limit_s = 60);

}  // namespace sectio

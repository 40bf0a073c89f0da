// TetGen as a program of its own, where it is installed: its licence and its crashes stay outside.
#pragma once

#include "common/mesh/tet_mesh.h"

namespace sectio {

bool tetgen_installed();

// `surface` as for fill_with_lattice(); its triangles are kept. Tetrahedra of at most largest_m3. Throws InputError
// when the program is not installed, fails, takes longer than limit_s or gives tetrahedra that don't pass check().
// Works in a directory of its own among the system's temporary files, which is removed.
TetMesh fill_with_tetgen(const TriangleSoup& surface, double largest_m3, double limit_s = 60);

}  // namespace sectio

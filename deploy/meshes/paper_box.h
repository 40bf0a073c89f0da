// The box of paper C (section 4, figure 4) by its numbers: 74 vertices, 196 tetrahedra and 1167 springs, edges and
// second neighbours (all pairs of vertices two edges apart). The paper gives neither its size nor its mesh, which
// TetGen made.
#pragma once

#include <string>

#include "common/mesh/tet_mesh.h"

namespace sectio {

// 80 x 80 x 25 mm around the origin.
TetMesh paper_box();

// Gmsh's format 2.2.
std::string msh(const TetMesh& mesh);

}  // namespace sectio

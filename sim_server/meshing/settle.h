// Vertices of a volume moved so that an explicit step can be larger, their number and connections kept.
#pragma once

#include "common/mesh/tet_mesh.h"

namespace sectio {

// The step is limited by the largest D_i = sum_e V_e |g_i|^2 / sum_e V_e / 4 over the tetrahedra e at a vertex i (g_i
// the gradient of its shape function): stiffness over mass, the material left out. Each vertex in turn tries the middle
// of its neighbours, half and a quarter of the way there, and goes where the largest D around it becomes smaller and no
// tetrahedron around it worse than the worst was; one of the boundary stays on `surface`. Deterministic; O(passes n).
void settle(TetMesh& mesh, const TriangleSoup& surface, double cell_m, int passes = 8);

}  // namespace sectio

// Moves the vertices of a volume so that its stable explicit step grows; number and connections stay.
#pragma once

#include <functional>

#include "common/mesh/tet_mesh.h"
#include "sim_server/meshing/surface_creases.h"

namespace sectio {

// The step is limited by the largest D_i = sum_e V_e |g_i|^2 / sum_e V_e / 4 over the tetrahedra e at a vertex i (g_i
// the gradient of its shape function), which is stiffness over mass without the material. Each vertex in turn tries the
// centre of its neighbours, half and a quarter of the way there, and moves if the largest D around it decreases and no
// tetrahedron around it is worse than the worst was. Vertices of the boundary stay on the surface, those with a seat on
// their seat; `seats` is empty when none has one. Vertices for which `where` says no stay; empty: none does.
// Deterministic; O(passes n).
using RelaxWhere = std::function<bool(const Vec3& vertex_body_m)>;
void relax(TetMesh& mesh, const SurfaceCreases& creases, const std::vector<Seat>& seats, const RelaxWhere& where = {},
           int passes = 8);

}  // namespace sectio

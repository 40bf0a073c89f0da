// Makes tetrahedra follow the sharp edges of the surface that they fill. A lattice that is fitted to a surface cuts its
// sharp edges off: the tetrahedra's boundary passes from face to face along edges of its own, each of which has one end
// on one face and one on the other. Such an edge is bisected, and the new vertex moves out to the crease; or one of its
// ends, when it is near, moves there itself: whichever leaves the better tetrahedra. A boundary triangle whose corners
// are on three creases gets its corner likewise. Tetrahedra that become flat against a face are removed.
#pragma once

#include <vector>

#include "common/mesh/tet_mesh.h"
#include "sim_server/meshing/surface_creases.h"

namespace sectio {

// Boundary vertices of `mesh` lie on the surface. Returns the seat of each vertex. An edge that can't be made sharp
// without a tetrahedron that is nearly flat stays as it is.
std::vector<Seat> sharpen(TetMesh& mesh, const SurfaceCreases& creases, double cell_m);

}  // namespace sectio

// Makes the triangles of a closed manifold surface about equilateral and of one size (Botsch and Kobbelt 2004).
#pragma once

#include "common/mesh/triangle_mesh.h"

namespace sectio {

// Rounds of splitting long edges, collapsing short ones, flipping towards six neighbours a vertex, and moving vertices
// along the surface, onto the one that was given. The surface stays a closed manifold of the same topology.
// Deterministic; O(rounds n log n).
TriangleSoup remeshed(const TriangleSoup& surface, double edge_m, int rounds = 8);

double smallest_angle_rad(const TriangleSoup& surface);

}  // namespace sectio

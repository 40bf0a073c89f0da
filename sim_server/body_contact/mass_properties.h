// Volume, centre and inertia tensor of the space inside a closed surface: exact integrals of polynomials over the
// tetrahedra between the triangles and one point (Tonon 2004). Pure; O(triangles).
#pragma once

#include <span>

#include "common/mesh/triangle_mesh.h"

namespace sectio {

struct MassProperties {
  double volume_m3 = 0;
  double mass_kg = 0;
  Vec3 centre_m = Vec3::Zero();
  Mat3 inertia_kg_m2 = Mat3::Zero();  // about the centre, axes of the frame of the positions
};

// Positions: one a vertex slot. Dead triangles are skipped. Triangles that face outwards make a positive volume; if the
// volume is not positive, the centre is the first vertex and the inertia zero.
MassProperties mass_properties(std::span<const Vec3> positions_m, std::span<const Triangle> triangles,
                               double density_kg_per_m3);

}  // namespace sectio

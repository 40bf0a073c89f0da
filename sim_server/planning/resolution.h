// Numbers of elements for a given resolution.
#pragma once

#include <algorithm>
#include <cmath>

namespace sectio::planning {

// The lattice mesher (meshing/lattice_mesher.h) makes 12 tetrahedra for a cube of its lattice.
inline double tetrahedra_for(double volume_m3, double cube_m) {
  return 12 * volume_m3 / (cube_m * cube_m * cube_m);
}
inline double cube_for(double volume_m3, double tetrahedra) {
  return std::cbrt(12 * volume_m3 / tetrahedra);
}

// Tetrahedra that a cut adds on each squared edge of such a cube.
constexpr double kMorePerSquare = 45;

// Tetrahedra embedded in hexahedra cost little, and their edges are those of the body: two of their cubes along a cell,
// within these limits.
constexpr double kMostEmbedded = 24000, kFewestEmbedded = 1000;
inline double embedded_for(double volume_m3, double cell_m) {
  return std::clamp(tetrahedra_for(volume_m3, cell_m / 2), kFewestEmbedded, kMostEmbedded);
}

}  // namespace sectio::planning

// How finely the inside of a body is divided, and what carries what.
#pragma once

#include <algorithm>
#include <cmath>

namespace sectio::planning {

// Of the lattice mesher (meshing/lattice_mesher.h): 12 tetrahedra to a cube of its lattice.
inline double tetrahedra_for(double volume_m3, double cube_m) {
  return 12 * volume_m3 / (cube_m * cube_m * cube_m);
}
inline double cube_for(double volume_m3, double tetrahedra) {
  return std::cbrt(12 * volume_m3 / tetrahedra);
}

// Tetrahedra that ride on hexahedra cost little, but their edges are the body's: two of their cubes along a cell, as
// far as so many tetrahedra go.
constexpr double kMostRiders = 24000, kFewestRiders = 1000;
inline double riders_for(double volume_m3, double cell_m) {
  return std::clamp(tetrahedra_for(volume_m3, cell_m / 2), kFewestRiders, kMostRiders);
}

}  // namespace sectio::planning

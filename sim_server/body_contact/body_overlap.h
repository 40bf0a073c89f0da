// How far two bodies, or the parts of one, are in each other, for the report of a run.
#pragma once

#include <cstddef>

#include "sim_server/body_contact/find_bodies.h"

namespace sectio {

struct Overlap {
  double deepest_m = 0;          // how far a vertex of one lies beneath the surface of the other
  std::size_t come_through = 0;  // vertices that have the other body, or a sheet of it, behind them in their own
};

// All vertices are probed. O(vertices x log triangles).
Overlap overlap_of(const SearchedSurface& one, const SearchedSurface& other);

// Vertices of the skin of loose parts of a body that lie in the tissue of the others: such a part has sunk in.
std::size_t sunken_skin(const SearchedSurface& body);

}  // namespace sectio

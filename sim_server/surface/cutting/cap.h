// The face that closes a loop of vertices, as the bed of a freed piece and its underside: rings between the rim and its
// middle, coarser towards the middle, so that no triangle is a splinter from the rim to one vertex.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim_server/surface/cutting/mesh_draft.h"

namespace sectio {

// Vertices are numbered from those of the rim, in their order, on to the inner ones. Triangles turn as the rim does.
struct Cap {
  std::vector<VertexState> inner;  // the last one is the middle of the rim
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

// Inner vertices are weighted means of at least three rim vertices: at rest, in the world, and in motion alike.
Cap cap_of(std::span<const VertexState> rim);

}  // namespace sectio

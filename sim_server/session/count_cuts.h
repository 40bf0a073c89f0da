// Counts cuts as a person does, who sees one where two walls face each other.
#pragma once

#include <cstdint>
#include <span>

#include "common/math/types.h"
#include "common/mesh/triangle_mesh.h"

namespace sectio {

constexpr double kLeastPiece_m3 = 1e-12;  // a crack inside a volume encloses nothing

struct CutSurface {
  const TriangleMesh* mesh = nullptr;  // not null
  Pose at_rest_world;
  std::uint32_t family = 0;  // the same for all bodies that were cut from one
  double groove_m = 0;       // the width with which cuts are made at rest
};

// Connected walls, of which those of a family are one that face each other at rest: both sides of a cut that has
// gone through a part of a body, a piece and its bed. The walls of cracks don't count. O(n).
std::size_t count_cuts(std::span<const CutSurface> surfaces);

}  // namespace sectio

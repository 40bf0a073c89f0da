// A loop of cuts frees an island (paper B, 5.2): skin that grooves have separated from the rest becomes a component of
// its own, together with the walls on its side of the groove's bottom; both sides are capped at the bottom.
#pragma once

#include <optional>
#include <vector>

#include "sim_server/surface/cutting/grooves.h"
#include "sim_server/surface/cutting/mesh_draft.h"

namespace sectio {

struct Island {
  VertexId any_vertex = kNone;            // one of the island's own component
  Vec3 bed_point_world_m = Vec3::Zero();  // middle of the cap
  Vec3 bed_normal_world = Vec3::UnitZ();  // towards the island
};

// `left` and `right` are the halves of a vertex that a cut has just opened. The search runs from both sides at once, so
// that its time grows with the smaller side only. A bottom that meets itself, as where a cut overruns its beginning, is
// parted there on both sides; ground that would then be a crumb by itself goes with the island. Nothing if the skin is
// still connected, or if the skin is but a crumb; the island then stays attached, and the surface is valid.
std::optional<Island> free_island(MeshDraft& draft, const Grooves& grooves, VertexId left, VertexId right);

}  // namespace sectio

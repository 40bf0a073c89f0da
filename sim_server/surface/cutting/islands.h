// A loop of cuts frees an island (paper B, 5.2): skin that grooves have separated from the rest becomes a component of
// its own, together with the walls on its side of the groove's bottom; both sides are capped at the bottom.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "sim_server/surface/cutting/grooves.h"
#include "sim_server/surface/cutting/mesh_draft.h"

namespace sectio {

struct Island {
  VertexId any_vertex = kNone;            // one of the island's own component
  Vec3 bed_point_world_m = Vec3::Zero();  // middle of the cap
  Vec3 bed_normal_world = Vec3::UnitZ();  // towards the island
};

struct LoopOutcome {
  std::optional<Island> island;
  std::string_view why_not;  // empty: freed, or there was nothing to be freed
};

// `left` and `right` are the halves of a vertex that a cut has just opened. The search runs from both sides at once, so
// that its time grows with the smaller side only. A bottom that meets itself, as where a cut overruns its beginning, is
// parted there on both sides; ground that would then be a crumb by itself goes with the island. Nothing happens if the
// skin is still connected, or if the skin is but a crumb; it then stays attached, and the surface is valid.
//
// A cap says that the blade has undercut the island. It stands for ground that is at most four times as thick as the
// groove is deep, or for a neck that is no wider than that; a ring in the skin of a limb doesn't sever it. One of the
// two sides has to be like that, whichever has fewer triangles.
LoopOutcome free_island(MeshDraft& draft, const Grooves& grooves, VertexId left, VertexId right);

}  // namespace sectio

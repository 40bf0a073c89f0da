// The one way in which the topology of a body changes: cuts, collapsed edges, temporary elements, parts that leave.
#pragma once

#include <cstdint>

#include "sim_server/step/step.h"
#include "sim_server/world/change.h"

namespace sectio {

// In this order: the mesh, the state of its vertices, the engines, the lips (Body::apply), the contacts of edges, what
// jaws hold, the output. Whoever has to follow a change of topology is told here. False when the mesh can't be changed
// so: it is as before, and only strokes have ended.
bool commit(World& world, StepContext& context, std::uint32_t body_id, Change change);

}  // namespace sectio

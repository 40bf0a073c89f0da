// The one way in which the topology of a body changes: cuts, collapsed edges, temporary elements, parts that leave.
#pragma once

#include <cstdint>

#include "sim_server/step/step.h"
#include "sim_server/world/change.h"

namespace sectio {

// Changes, in this order: the mesh, the state of its vertices, the engines, the lips (Body::apply), the engines between
// bodies, the contacts of edges, the grasps of jaws, the output. A new listener to changes of topology is added here.
// False when the change does not fit the mesh, which is as before; only strokes have ended.
bool commit(SimulatedWorld& world, StepContext& context, std::uint32_t body_id, Change change);

}  // namespace sectio

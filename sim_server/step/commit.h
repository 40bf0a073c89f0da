// The one way in which the topology of a body changes: cuts, collapsed edges, temporary elements, parts that leave.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "sim_server/step/step.h"
#include "sim_server/world/change.h"

namespace sectio {

// Changes, in this order: the mesh, the state of its vertices, the engines, the lips (Body::apply), the engines between
// bodies, the contacts of edges, the grasps of jaws, the output. A new listener to changes of topology is added here.
// False when the change does not fit the mesh, which is as before; only strokes have ended.
bool commit(SimulatedWorld& world, StepContext& context, std::uint32_t body_id, Change change);

// The one way in which a part becomes a body of its own, while its parent still has it: tells, in this order, the
// grasps of jaws, the engines between bodies, the world, the output. A new listener to parts is added here.
// `vertex_from`: the part's vertices in the parent. The caller then commits the change that takes the part out.
void welcome_part(SimulatedWorld& world, StepContext& context, std::uint32_t parent_id, std::unique_ptr<Body> part,
                  std::span<const VertexId> vertex_from);

}  // namespace sectio

#include "sim_server/step/commit.h"

#include <utility>

namespace sectio {

bool commit(SimulatedWorld& world, StepContext& context, std::uint32_t body_id, Change change) {
  Body& body = *world.bodies[body_id];
  const auto applied = body.apply(change);
  if (!applied) return false;
  if (change.delta.empty()) return true;
  for (Interaction& interaction : world.interactions)
    if (interaction.covers(body_id)) interaction.engine->follow(body.shared(), applied->of(change.delta));
  for (EdgeContact& contact : world.contacts_of(body_id)) contact.follow(change.cause, applied->triangles);
  for (Tool& tool : world.tools) tool.grasp.follow(body_id, change.delta);
  context.bodies[body_id].changed = true;
  context.output.deltas.push_back({body_id, std::move(change.delta)});
  return true;
}

}  // namespace sectio

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

void welcome_part(SimulatedWorld& world, StepContext& context, std::uint32_t parent_id, std::unique_ptr<Body> part,
                  std::span<const VertexId> vertex_from) {
  Body& parent = *world.bodies[parent_id];
  for (Tool& tool : world.tools) tool.grasp.part_left(parent_id, *part, vertex_from);
  for (Interaction& interaction : world.interactions) {
    if (!interaction.covers(parent_id)) continue;
    interaction.bodies.push_back(part->id);
    interaction.engine->part_left(parent.shared(), part->shared(), vertex_from);
  }
  const char* kind = !part->deforms() ? "rigid" : part->spec.fixed ? "anchored" : "deformable";
  context.emit(EventKind::body_split, parent_id, 0, part->spec.name + ", " + kind);
  context.output.new_bodies.push_back({part->id, parent_id, part->spec.name});
  context.output.publish_now = true;
  world.add_part(std::move(part), parent, vertex_from);
  context.bodies.emplace_back();
}

}  // namespace sectio

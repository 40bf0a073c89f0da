#include "sim_server/step/step.h"

namespace sectio {

void watch(SimulatedWorld& world, StepContext& context) {
  for_each_body(world, context, [&](std::uint32_t b) {
    Body& body = *world.bodies[b];
    if (!context.bodies[b].disturbed && !context.input.spare_idle_bodies && !world.is_moved_from_outside(b))
      body.watch_rest(world.scene);
    for (auto& [kind, text] : body.watch_driver()) context.emit(kind, b, 0, std::move(text));
  });
}

}  // namespace sectio

#include <algorithm>

#include "sim_server/step/step.h"

namespace sectio {

// A body that is spared is a wall for those that go on: what was given to it now, it couldn't answer in this step.
void spare(SimulatedWorld& world, StepContext& context) {
  for (std::uint32_t b = 0; b < world.bodies.size(); ++b) {
    Body& body = *world.bodies[b];
    const bool is_held =
        std::ranges::any_of(world.tools, [&](const Tool& tool) { return tool.grasp.holds(b); }) ||
        std::ranges::any_of(world.interactions, [&](const Interaction& between) { return between.covers(b); });
    body.spared = context.input.spare_idle_bodies && body.deforms() && !is_held && is_idle(world, context, b);
  }
}

}  // namespace sectio

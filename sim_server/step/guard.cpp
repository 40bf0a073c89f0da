#include <cmath>

#include "sim_server/step/step.h"

namespace sectio {

void guard(SimulatedWorld& world, StepContext& context) {
  for_each_body(world, context, [&](std::uint32_t b) {
    const bool touched = context.bodies[b].disturbed;
    for (auto& [kind, text] : world.bodies[b]->guard(touched, world.scene.step_s))
      context.emit(kind, b, 0, std::move(text));
  });
}

void make_finite(std::span<Reaction> reactions) {
  for (Reaction& r : reactions)
    if (!r.force_on_tool_n.allFinite() || !std::isfinite(r.work_j)) r = {.is_known = false};
}

}  // namespace sectio

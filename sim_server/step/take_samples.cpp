#include <cmath>

#include "sim_server/step/step.h"

namespace sectio {

void take_samples(SimulatedWorld& world, StepContext& context) {
  for (Tool& tool : world.tools) tool.begin_step();
  for (const ToolSample& sample : context.input.samples)
    if (sample.tool_id < world.tools.size() && is_finite(sample.pose_world) && std::isfinite(sample.opening_rad))
      world.tools[sample.tool_id].take(sample);
  for (const std::uint32_t t : context.input.withdrawn) {
    if (t >= world.tools.size() || !world.tools[t].withdraw()) continue;
    const ToolSpec& spec = world.scene.tools[t];
    context.emit(EventKind::instrument_withdrawn, 0, t, spec.name + " is withdrawn from where it was");
  }
}

}  // namespace sectio

#include "sim_server/step/step.h"

namespace sectio {

void take_samples(SimulatedWorld& world, StepContext& context) {
  for (Tool& tool : world.tools) tool.begin_step();
  for (const ToolSample& sample : context.input.samples)
    if (sample.tool_id < world.tools.size()) world.tools[sample.tool_id].take(sample);
}

void grasp(SimulatedWorld& world, StepContext&) {
  for (Tool& tool : world.tools)
    if (tool.pose) tool.grasp.follow(*tool.pose, world.bodies);
}

}  // namespace sectio

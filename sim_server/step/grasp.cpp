#include "sim_server/step/step.h"

namespace sectio {

void grasp(SimulatedWorld& world, StepContext&) {
  for (Tool& tool : world.tools)
    if (tool.pose) tool.grasp.follow(*tool.pose, world.bodies, world.scene.step_s);
}

}  // namespace sectio

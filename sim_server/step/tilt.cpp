#include "sim_server/step/step.h"

namespace sectio {

// Gives the new gravity to all bodies, and wakes all bodies.
void tilt(SimulatedWorld& world, StepContext& context) {
  context.gravity_turned = world.gravity.step(context.input, context.output);
  if (!context.gravity_turned) return;
  world.scene.gravity_m_per_s2 = world.gravity.now();
  for (const auto& body : world.bodies) {
    body->wake();
    body->engines.deformation->set_gravity(world.gravity.now());
  }
}

}  // namespace sectio

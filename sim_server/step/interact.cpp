#include "sim_server/step/step.h"

namespace sectio {

void interact(SimulatedWorld& world, StepContext&) {
  for (Interaction& interaction : world.interactions) {
    std::vector<SharedBody> bodies;
    for (const std::uint32_t b : interaction.bodies) bodies.push_back(world.bodies[b]->shared());
    interaction.engine->step(bodies, world.scene.step_s);
    if (!interaction.engine->moves_particles()) continue;
    for (const std::uint32_t b : interaction.bodies) world.bodies[b]->particles_moved();
  }
}

}  // namespace sectio

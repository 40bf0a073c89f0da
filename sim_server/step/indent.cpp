#include "sim_server/step/commit.h"
#include "sim_server/step/step.h"
#include "sim_server/world/indentation.h"

namespace sectio {

void indent(SimulatedWorld& world, StepContext& context) {
  std::vector<ContactPoint> points;
  std::vector<HeldParticle> held;
  for_each_body(world, context, [&](std::uint32_t b) {
    Body& body = *world.bodies[b];
    if (!body.contact_by_templates()) return;
    points.clear();
    for (const EdgeContact& contact : world.contacts_of(b))
      points.insert(points.end(), contact.contact_points().begin(), contact.contact_points().end());
    watch_particles_let_go(body, points, world.scene.step_s);
    if (auto change = plan_indentation(body, points, held)) commit(world, context, b, std::move(*change));
    for (EdgeContact& contact : world.contacts_of(b)) contact.hold_particles(held);
  });
}

}  // namespace sectio

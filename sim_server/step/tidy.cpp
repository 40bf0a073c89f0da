#include "sim_server/step/commit.h"
#include "sim_server/step/step.h"

namespace sectio {

void tidy(SimulatedWorld& world, StepContext& context) {
  for_each_body(world, context, [&](std::uint32_t b) {
    const BodyStep& step = context.bodies[b];
    if (step.at_work || !step.entries.empty() || !step.motions.empty()) return;
    if (!is_idle(world, context, b)) return;
    TidyPlan plan = world.bodies[b]->engines.cutting->tidy(world.bodies[b]->shared());
    if (plan.ticket && commit(world, context, b, {Cause::tidied, std::move(plan.delta), {}, plan.ticket}))
      context.output.report.edges_collapsed += plan.edges_collapsed;
  });
}

}  // namespace sectio

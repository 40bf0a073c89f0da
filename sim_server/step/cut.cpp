#include "sim_server/step/commit.h"
#include "sim_server/step/step.h"

namespace sectio {
namespace {

void cut_body(SimulatedWorld& world, StepContext& context, std::uint32_t b) {
  Body& body = *world.bodies[b];
  BodyStep& step = context.bodies[b];
  StepReport& report = context.output.report;
  for (BladeMotion& motion : step.motions) body.express_in_rest_frame(step.entries, motion);
  const CutPlan plan = body.engines.cutting->plan(body.shared(), step.entries, step.motions);
  const bool accepted = commit(world, context, b, cut_as_planned(plan));
  report.cuts_made += accepted && !plan.delta.empty();
  report.cuts_refused += plan.refused + (accepted ? 0u : 1u);
  for (EdgeContact& contact : world.contacts_of(b)) contact.planned(plan, accepted);
  if (!accepted) return;
  for (std::size_t i = 0; i < plan.islands.size(); ++i)
    context.emit(EventKind::island_freed, b, 0, "a piece of " + body.spec.name + " is free");
  for (const auto& [edge_id, why] : plan.kept_islands)
    context.emit(EventKind::island_kept, b, world.edges[edge_id].tool_id,
                 "a piece of " + body.spec.name + " is not free: " + std::string(why));
}

}  // namespace

void cut(SimulatedWorld& world, StepContext& context) {
  for_each_body(world, context, [&](std::uint32_t b) {
    const BodyStep& step = context.bodies[b];
    if (step.entries.empty() && step.motions.empty()) return;
    cut_body(world, context, b);
  });
}

}  // namespace sectio

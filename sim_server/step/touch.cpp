#include "sim_server/step/commit.h"
#include "sim_server/step/step.h"
#include "sim_server/world/indentation.h"

namespace sectio {
namespace {

// Undoes temporary elements before anything cuts or parts the body.
void remove_templates(SimulatedWorld& world, StepContext& context, std::uint32_t body_id) {
  if (auto change = plan_release(*world.bodies[body_id])) commit(world, context, body_id, std::move(*change));
}

}  // namespace

void touch(SimulatedWorld& world, StepContext& context) {
  for_each_body(world, context, [&](std::uint32_t b) {
    BodyStep& body = context.bodies[b];
    body.at_work = !world.bodies[b]->unsettled.empty();
    const auto each_edge = [&](const auto& call) {
      for (std::uint32_t e = 0; e < world.edges.size(); ++e)
        if (Tool& tool = world.tool_of(e); tool.pose) call(tool, world.contact(b, e));
    };
    each_edge([&](Tool& tool, EdgeContact& contact) {
      if (tool.grasp.holds(b)) return contact.let_go();
      if (tool.arrives) contact.arrive();
      contact.approach(tool.before, tool.poses, tool.continuous);
      body.at_work |= contact.is_at_work();
    });
    if (body.at_work) remove_templates(world, context, b);
    each_edge([&](Tool& tool, EdgeContact& contact) {
      if (!tool.grasp.holds(b)) contact.plan(tool.poses, body.entries, body.motions);
    });
  });
}

}  // namespace sectio

#include "sim_server/step/step.h"

namespace sectio {
namespace {

// Adds up the forces of all edges; the deepest contact gives the place.
void add_edge(const EdgeContact& contact, ContactStep& felt) {
  felt.reaction_world_n += contact.force_on_tool_n();
  if (contact.state() <= felt.state) return;
  felt.state = contact.state();
  felt.surface_known = contact.surface_known();
  felt.point_world_m = contact.point_world_m();
  felt.normal_world = contact.normal_world();
}

}  // namespace

void feel(SimulatedWorld& world, StepContext& context) {
  bool in_contact = false;
  for (std::uint32_t t = 0; t < world.tools.size(); ++t) {
    Tool& tool = world.tools[t];
    for (const auto& [kind, body_id, text] : tool.grasp.take_events())
      context.emit(kind, body_id, t, std::string(text));
    if (!tool.pose) continue;
    ContactStep felt = tool.contact(context.output.sim_time_s);
    for (std::uint32_t b = 0; b < world.bodies.size(); ++b)
      for (std::uint32_t e = 0; e < world.edges.size(); ++e)
        if (world.edges[e].tool_id == t) add_edge(world.contact(b, e), felt);
    in_contact |= felt.state != ContactState::free;
    context.output.contacts.push_back(tool.fitter.fit(felt));
  }
  if (in_contact) context.output.report.contact_time_s += world.scene.step_s;
}

}  // namespace sectio

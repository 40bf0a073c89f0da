#include <algorithm>
#include <cmath>

#include "sim_server/step/step.h"
#include "sim_server/world/surface_under_tool.h"

namespace sectio {
namespace {

// A surface this near to a free tool is told to the hand, which meets it without the delay of the wire: 20 mm are the
// way of a quick hand, 0.4 m/s, in the time for which a contact model lives.
constexpr double kFeelReach_m = 0.02;

// Adds up the forces of all edges; the deepest contact gives the place, which is returned.
void add_edge(const EdgeContact& contact, ContactStep& felt, Vec3& at_world_m) {
  felt.reaction_world_n += contact.force_on_tool_n();
  if (contact.state() <= felt.state) return;
  felt.state = contact.state();
  felt.surface_known = contact.surface_known();
  felt.body_id = contact.body_id();
  felt.normal_world = contact.normal_world();
  felt.front = contact.front();
  at_world_m = contact.point_world_m();
  felt.lever_world_m = at_world_m - felt.tip.position_m;
}

// Fills in where the surface under a tool would be without the dent. It was found before the touch, and has moved with
// the surface around since.
void place_dented(Body& body, const ToolSpec& spec, Tool& tool, const Vec3& at_world_m, double step_s,
                  ContactStep& felt) {
  const SurfaceMotion around = motion_beyond_dent(body, at_world_m);
  const Vec3 tool_m_per_s = tool.tip.velocity_m_per_s;
  tool.own_dent.learn(around.velocity_m_per_s, tool_m_per_s, step_s);
  const double g = tool.own_dent.share();
  felt.surface_velocity_world_m_per_s = around.velocity_m_per_s - g * (tool_m_per_s - around.velocity_m_per_s);
  if (const auto rest = rest_surface(body, at_world_m)) {
    const double above_undeformed_m = gap_m(spec, *tool.pose, rest->point_world_m, felt.normal_world);
    const double around_m = tool.sags_more_m + felt.normal_world.dot(around.from_undeformed_m);
    felt.gap_m = above_undeformed_m - around_m - g * std::max(0.0, around_m - above_undeformed_m);
  }
}

// Tells what the tool touches or would: the body that jaws hold, that an edge presses or cuts, else the nearest one.
void add_surface(SimulatedWorld& world, std::uint32_t tool_id, Vec3 at_world_m, ContactStep& felt) {
  Tool& tool = world.tools[tool_id];
  const ToolSpec& spec = world.scene.tools[tool_id];
  if (const auto held = tool.grasp.held_body(); held && felt.body_id == kNoBody) {
    felt.body_id = *held;  // its points follow the hand, not the tissue around
  } else if (felt.body_id != kNoBody) {
    place_dented(*world.bodies[felt.body_id], spec, tool, at_world_m, world.scene.step_s, felt);
  } else if (const auto near = nearest_surface(world.bodies, spec, *tool.pose, kFeelReach_m)) {
    Body& body = *world.bodies[near->body_id];
    felt.body_id = near->body_id;
    at_world_m = near->point_world_m;
    felt.normal_world = near->normal_world;
    if (felt.state == ContactState::free) {
      felt.surface_known = true;
      felt.gap_m = near->gap_m;
      felt.surface_velocity_world_m_per_s = velocity_at(body, near->triangle, at_world_m);
      const auto rest = rest_surface(body, at_world_m);
      const Vec3 sags = rest ? Vec3(at_world_m - rest->point_world_m) : Vec3(Vec3::Zero());
      tool.sags_more_m = near->normal_world.dot(sags - motion_beyond_dent(body, at_world_m).from_undeformed_m);
    } else {  // a ball about the tip pushes it
      if (const auto rest = rest_surface(body, at_world_m)) felt.normal_world = rest->normal_world;
      place_dented(body, spec, tool, at_world_m, world.scene.step_s, felt);
      felt.lever_world_m = at_world_m - felt.tip.position_m;
    }
  }
  if (felt.body_id != kNoBody) felt.tissue = felt_tissue(*world.bodies[felt.body_id], at_world_m, spec, felt.state);
}

// The reaction as the hand may feel it; its first step beyond that is an event.
void cap_force(const SimulatedWorld& world, StepContext& context, std::uint32_t t, Tool& tool, ContactStep& felt) {
  const double most_n = world.scene.tools[t].largest_force_n, size_n = felt.reaction_world_n.norm();
  const bool beyond = !(size_n <= most_n);
  if (beyond) {
    felt.reaction_world_n = std::isfinite(size_n) ? Vec3(most_n / size_n * felt.reaction_world_n) : Vec3::Zero();
    ++context.output.report.forces_capped;
    if (!tool.force_is_capped) context.emit(EventKind::force_capped, felt.body_id == kNoBody ? 0 : felt.body_id, t);
  }
  tool.force_is_capped = beyond;
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
    Vec3 at_world_m = felt.tip.position_m;
    for (std::uint32_t b = 0; b < world.bodies.size(); ++b)
      for (std::uint32_t e = 0; e < world.edges.size(); ++e)
        if (world.edges[e].tool_id == t) add_edge(world.contact(b, e), felt, at_world_m);
    if (tool.is_withdrawn) {  // nobody is there to feel it
      if (felt.state == ContactState::free) tool.pose.reset();
      continue;
    }
    add_surface(world, t, at_world_m, felt);
    cap_force(world, context, t, tool, felt);
    in_contact |= felt.state != ContactState::free;
    ContactModel model = tool.fitter.fit(felt);
    model.yield_n =
        std::min(model.yield_n, world.scene.tools[t].largest_force_n);  // the hand's own motion adds no more
    context.output.contacts.push_back(model);
  }
  if (in_contact) context.output.report.contact_time_s += world.scene.step_s;
}

}  // namespace sectio

#include <algorithm>
#include <map>

#include "sim_server/step/step.h"

namespace sectio {
namespace {

// Sources of constraints: edges of instruments, then jaws by their tool, engines between bodies, and other bodies.
std::uint32_t grasp_source(const SimulatedWorld& world, std::size_t tool_id) {
  return static_cast<std::uint32_t>(world.edges.size() + tool_id);
}
std::uint32_t interaction_source(const SimulatedWorld& world, std::size_t i) {
  return grasp_source(world, world.tools.size() + i);
}

std::uint32_t wall_source(const SimulatedWorld& world) {
  return interaction_source(world, world.interactions.size());
}

void deform_body(SimulatedWorld& world, StepContext& context, std::uint32_t b,
                 std::vector<PointConstraint>& constraints, std::vector<Reaction>& reactions) {
  Body& body = *world.bodies[b];
  BodyStep& step = context.bodies[b];
  constraints.clear();
  const auto say_whose = [&](std::size_t from, std::uint32_t source) {
    for (std::size_t i = from; i < constraints.size(); ++i) constraints[i].source = source;
  };
  for (std::uint32_t e = 0; e < world.edges.size(); ++e) {
    // Jaws that hold the tissue don't push it away.
    if (!world.tool_of(e).pose || world.tool_of(e).grasp.holds(b)) continue;
    const std::size_t from = constraints.size();
    const auto of_edge = world.contact(b, e).constraints();
    constraints.insert(constraints.end(), of_edge.begin(), of_edge.end());
    say_whose(from, e);
    for (std::size_t i = from; i < constraints.size(); ++i)
      constraints[i].target_velocity_m_per_s = world.tool_of(e).velocity_m_per_s;
  }
  const std::size_t of_edges = constraints.size();
  for (std::uint32_t t = 0; t < world.tools.size(); ++t) {
    const std::size_t from = constraints.size();
    if (world.tools[t].pose) world.tools[t].grasp.append(body, world.scene.step_s, constraints);
    say_whose(from, grasp_source(world, t));
  }
  for (std::size_t i = 0; i < world.interactions.size(); ++i) {
    const std::size_t from = constraints.size();
    if (world.interactions[i].covers(b))
      world.interactions[i].engine->constrain(body.shared(), world.scene.step_s, constraints);
    say_whose(from, interaction_source(world, i));
  }
  step.disturbed = constraints.size() > of_edges || !is_idle(world, context, b);
  const std::size_t first_wall = constraints.size();
  for (const BodyStep::Wall& wall : step.walls) constraints.push_back(wall.constraint);
  say_whose(first_wall, wall_source(world));
  reactions.assign(constraints.size(), {});
  if (step.disturbed && body.deforms()) body.wake();  // another wakes when it is pressed or held
  if (!body.spared) body.deform(constraints, reactions, world.scene.step_s);
  make_finite(reactions);
  for (std::size_t i = 0; i < first_wall; ++i) step.work_j += reactions[i].work_j;
  world.contact_work_j += step.work_j;
  for (std::size_t i = 0; i < step.walls.size(); ++i) {
    const Reaction& reaction = reactions[first_wall + i];
    step.work_j += reaction.work_j;
    if (const auto meeting = step.walls[i].meeting) context.meetings[*meeting].on_both_n -= reaction.force_on_tool_n;
  }
  if (body.deforms()) distribute_reactions(world, context, b, constraints, reactions);  // else after collide()
}

// Two bodies that met moved one after the other, each against where the other was. They share the momentum that one has
// gained and the other hasn't lost; the wall or bone that holds a body takes its part.
void even_out(SimulatedWorld& world, const StepContext& context) {
  std::map<std::uint32_t, Vec3> missing_n_s;
  for (const Meeting& meeting : context.meetings) {
    const auto moves = [&](std::uint32_t b) { return !world.bodies[b]->stands_still(); };
    if (!std::ranges::all_of(meeting.bodies, moves)) continue;
    for (const std::uint32_t b : meeting.bodies)
      if (!world.bodies[b]->spec.fixed)
        missing_n_s.try_emplace(b, Vec3::Zero()).first->second -= 0.5 * world.scene.step_s * meeting.on_both_n;
  }
  for (const auto& [b, impulse_n_s] : missing_n_s)
    if (!impulse_n_s.isZero(0)) world.bodies[b]->push_as_one(impulse_n_s);
}

}  // namespace

bool is_idle(SimulatedWorld& world, const StepContext& context, std::uint32_t body_id) {
  return !context.bodies[body_id].changed && std::ranges::all_of(world.contacts_of(body_id), [](const EdgeContact& c) {
    return c.state() == ContactState::free && c.constraints().empty();
  });
}

void distribute_reactions(SimulatedWorld& world, StepContext& context, std::uint32_t body_id,
                          std::span<const PointConstraint> constraints, std::span<const Reaction> reactions) {
  for (std::uint32_t e = 0; e < world.edges.size(); ++e) {
    if (!world.tool_of(e).pose) continue;
    const auto from = std::ranges::lower_bound(constraints, e, {}, &PointConstraint::source);
    const auto to = std::ranges::upper_bound(constraints, e, {}, &PointConstraint::source);
    EdgeContact& contact = world.contact(body_id, e);
    contact.deformed(
        reactions.subspan(static_cast<std::size_t>(from - constraints.begin()), static_cast<std::size_t>(to - from)));
    for (const auto& [kind, text] : contact.take_events()) {
      context.emit(kind, body_id, world.edges[e].tool_id, std::string(text));
      context.output.publish_now |= kind == EventKind::contact_began;
    }
  }
  for (std::size_t i = 0; i < constraints.size(); ++i)
    if (const std::size_t source = constraints[i].source;
        source >= grasp_source(world, 0) && source < interaction_source(world, 0))
      world.tools[source - grasp_source(world, 0)].grasp.felt(reactions[i]);
  for (std::size_t k = 0; k < world.interactions.size(); ++k) {
    const auto is_own = [&](const PointConstraint& c) { return c.source == interaction_source(world, k); };
    const auto from = std::ranges::find_if(constraints, is_own);
    const auto count = static_cast<std::size_t>(std::ranges::count_if(constraints, is_own));
    if (count > 0)
      world.interactions[k].engine->felt(
          world.bodies[body_id]->shared(),
          reactions.subspan(static_cast<std::size_t>(from - constraints.begin()), count));
  }
}

void deform(SimulatedWorld& world, StepContext& context) {
  std::vector<PointConstraint> constraints;
  std::vector<Reaction> reactions;
  for_each_body(world, context, [&](std::uint32_t b) { deform_body(world, context, b, constraints, reactions); });
  even_out(world, context);
}

}  // namespace sectio

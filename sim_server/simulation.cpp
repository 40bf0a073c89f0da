#include "sim_server/simulation.h"

#include <algorithm>
#include <cstdio>
#include <deque>

#include "common/core/error.h"
#include "sim_server/engine/standard_engines.h"
#include "sim_server/step/collide.h"
#include "sim_server/step/split.h"
#include "sim_server/world/edge_contact.h"
#include "sim_server/world/indentation.h"
#include "sim_server/world/model_check.h"
#include "sim_server/world/tool.h"
#include "sim_server/world/turning_gravity.h"

namespace sectio {

namespace {

constexpr std::size_t kMostBodies = 256;  // that a session can announce

}  // namespace

struct Simulation::State {
  State(const Scene& s, const EngineTable& engines) : scene(s), gravity(scene) {
    for (std::uint32_t i = 0; i < scene.bodies.size(); ++i) {
      const auto make = engines.models.find(scene.bodies[i].model);
      if (make == engines.models.end())
        throw InputError(scene.file + ": bodies[" + std::to_string(i) + "].model: there are no engines for " +
                         scene.bodies[i].model);
      bodies.push_back(std::make_unique<Body>(scene.bodies[i], scene, i, make->second));
    }
    for (std::uint32_t i = 0; i < scene.tools.size(); ++i) tools.emplace_back(i, scene);
    for (std::uint32_t i = 0; i < scene.tools.size(); ++i)
      for (std::size_t e = 0; e < instrument_of(scene.tools[i].kind).edges; ++e) edges.push_back({i, e});
    for (auto& body : bodies) add_touches(*body);
    for (const auto& body : bodies) checks.emplace_back(body->spec);
  }

  void add_touches(Body& body);
  void take(const StepInput& input);
  void step_body(std::uint32_t body_id);
  void step_and_check(std::uint32_t body_id, bool gravity_turned);
  void tidy(std::uint32_t body_id);
  void press(std::uint32_t body_id);
  void release(std::uint32_t body_id);
  void deform(std::uint32_t body_id);
  bool is_idle(std::uint32_t body_id);
  void split(std::uint32_t body_id);
  void add_part(std::unique_ptr<Body> part, std::uint32_t parent_id);
  void move_rigid_pieces();
  void follow_hands();
  void tell_grips(std::span<const Reaction> reactions);
  void changed_topology(std::uint32_t body_id, TopologyDelta delta);
  void tell_touches(std::uint32_t body_id, const TopologyDelta& delta);
  void tell_touch(std::uint32_t body_id, std::uint32_t edge_id, std::size_t& next);
  void tell_of_grips();
  void fit_contact_models();
  void say(EventKind kind, std::uint32_t body_id, std::uint32_t tool_id, std::string text = {}) {
    output.events.push_back({output.step, kind, body_id, tool_id, std::move(text)});
  }
  EdgeContact& touch(std::uint32_t body_id, std::uint32_t edge_id) { return touches[body_id * edges.size() + edge_id]; }
  Tool& tool_of(std::uint32_t edge_id) { return tools[edges[edge_id].tool_id]; }

  Scene scene;  // its gravity is that of this step
  TurningGravity gravity;
  std::vector<std::unique_ptr<Body>> bodies;
  std::deque<BodySpec> part_specs;
  std::vector<Tool> tools;
  struct Edge {
    std::uint32_t tool_id = 0;
    std::size_t index = 0;  // of the tool's edges
  };
  std::vector<Edge> edges;           // of all tools; cutting knows each as a tool of its own
  std::vector<EdgeContact> touches;  // a row a body, a column an edge
  StepOutput output;
  std::vector<ModelCheck> checks;  // one a body
  double (*processor_s)() = nullptr;
  double contact_work_j = 0;  // so far
  bool spare_idle_bodies = false;

  // Scratch.
  std::vector<Entry> entries;
  std::vector<BladeMotion> motions;
  std::vector<TriangleId> changed;
  std::vector<ContactPoint> contact_points;
  std::vector<HeldParticle> held_particles;
  std::vector<PointConstraint> constraints;
  std::vector<Reaction> reactions;
  std::vector<RigidTouch> rigid_touches;
  std::vector<GraspConstraint> grips;
  std::vector<std::uint8_t> stirred;  // by body: touched, held or cut in this step
};

void Simulation::State::add_touches(Body& body) {
  for (std::uint32_t i = 0; i < edges.size(); ++i)
    touches.emplace_back(i, scene.tools[edges[i].tool_id], edges[i].index, body, !body.rigid);
}

void Simulation::State::take(const StepInput& input) {
  for (Tool& tool : tools) tool.begin_step();
  for (const ToolSample& sample : input.samples)
    if (sample.tool_id < tools.size()) tools[sample.tool_id].take(sample);
}

void Simulation::State::step_body(std::uint32_t body_id) {
  Body& body = *bodies[body_id];
  entries.clear();
  motions.clear();
  bool at_work = !body.unsettled.empty();
  for (std::uint32_t i = 0; i < edges.size(); ++i) {
    const Tool& tool = tool_of(i);
    if (!tool.pose) continue;
    if (tool.grip.holds(body_id)) {
      touch(body_id, i).let_go();
      continue;
    }
    touch(body_id, i).approach(tool.before, tool.poses, tool.continuous);
    at_work |= touch(body_id, i).is_at_work();
  }
  if (at_work) release(body_id);
  for (std::uint32_t i = 0; i < edges.size(); ++i)
    if (const Tool& tool = tool_of(i); tool.pose && !tool.grip.holds(body_id))
      touch(body_id, i).plan(tool.poses, entries, motions);

  if (body.rigid) return;
  if (!entries.empty() || !motions.empty()) {
    for (BladeMotion& motion : motions) body.see_from_rest(entries, motion);
    const CutPlan plan = body.engines.cutting->plan(body.shared(), body.cuts, entries, motions);
    const bool accepted = body.accept_plan(plan, changed);
    if (accepted && !plan.delta.empty()) {
      changed_topology(body_id, plan.delta);
      ++output.report.cuts_made;
    }
    output.report.cuts_refused += plan.refused + (accepted ? 0u : 1u);
    for (std::uint32_t i = 0; i < edges.size(); ++i) touch(body_id, i).planned(plan, accepted, changed);
    if (accepted)
      for (std::size_t i = 0; i < plan.islands.size(); ++i) say(EventKind::island_freed, body_id, 0);
  } else if (!at_work && is_idle(body_id)) {
    tidy(body_id);
  }
  split(body_id);
  press(body_id);
  deform(body_id);
}

void Simulation::State::step_and_check(std::uint32_t body_id, bool gravity_turned) {
  const double begun_s = processor_s ? processor_s() : 0, work_j = contact_work_j;
  step_body(body_id);
  const double took_s = processor_s ? processor_s() - begun_s : 0;
  const bool cut = std::ranges::any_of(output.deltas, [&](const BodyDelta& d) { return d.body_id == body_id; });
  checks[body_id].stepped(*bodies[body_id], scene.step_s, contact_work_j - work_j, cut || gravity_turned, took_s);
}

void Simulation::State::tidy(std::uint32_t body_id) {
  Body& body = *bodies[body_id];
  const std::uint64_t collapsed = body.engines.cutting->edges_collapsed();
  TopologyDelta delta = body.engines.cutting->tidy(body.shared());
  if (!delta.empty() && body.accept_change(delta, {})) {
    tell_touches(body_id, delta);
    changed_topology(body_id, std::move(delta));
  }
  output.report.edges_collapsed += body.engines.cutting->edges_collapsed() - collapsed;
}

// What they know of the surface.
void Simulation::State::tell_touches(std::uint32_t body_id, const TopologyDelta& delta) {
  changed.clear();
  for (const TriangleEdit& e : delta.triangles) changed.push_back(e.id);
  for (std::uint32_t i = 0; i < edges.size(); ++i) touch(body_id, i).surface_changed(changed);
}

void Simulation::State::release(std::uint32_t body_id) {
  if (auto delta = release_body(*bodies[body_id])) changed_topology(body_id, std::move(*delta));
}

void Simulation::State::changed_topology(std::uint32_t body_id, TopologyDelta delta) {
  for (Tool& tool : tools) tool.grip.topology_changed(body_id, delta);
  output.deltas.push_back({body_id, std::move(delta)});
}

void Simulation::State::press(std::uint32_t body_id) {
  Body& body = *bodies[body_id];
  if (!body.contact_by_templates()) return;
  contact_points.clear();
  for (std::uint32_t i = 0; i < edges.size(); ++i) {
    const auto points = touch(body_id, i).contact_points();
    contact_points.insert(contact_points.end(), points.begin(), points.end());
  }
  if (auto delta = press_body(body, contact_points, scene.step_s, held_particles))
    changed_topology(body_id, std::move(*delta));
  for (std::uint32_t i = 0; i < edges.size(); ++i) touch(body_id, i).hold_particles(held_particles);
}

// Nothing touches it, and no cut has changed it in this step.
bool Simulation::State::is_idle(std::uint32_t body_id) {
  for (std::uint32_t i = 0; i < edges.size(); ++i)
    if (touch(body_id, i).state() != ContactState::free || !touch(body_id, i).constraints().empty()) return false;
  return std::ranges::none_of(output.deltas, [&](const BodyDelta& d) { return d.body_id == body_id; });
}

void Simulation::State::deform(std::uint32_t body_id) {
  Body& body = *bodies[body_id];
  constraints.clear();
  for (std::uint32_t i = 0; i < edges.size(); ++i)
    if (const auto c = touch(body_id, i).constraints(); tool_of(i).pose)
      constraints.insert(constraints.end(), c.begin(), c.end());
  const std::size_t of_touches = constraints.size();
  for (Tool& tool : tools) tool.grip_constraints = tool.pose ? tool.grip.append(body, scene.step_s, constraints) : 0;
  reactions.assign(constraints.size(), {});
  const bool gripped = constraints.size() > of_touches;
  const bool left_alone = !gripped && is_idle(body_id);
  stirred[body_id] = !left_alone;
  if (!left_alone) body.wake();
  if (!(spare_idle_bodies && left_alone)) {
    body.deform(constraints, reactions, scene.step_s);
    if (left_alone) body.watch_rest(scene);
  }
  for (const Reaction& reaction : reactions) contact_work_j += reaction.work_j;
  std::size_t next = 0;
  for (std::uint32_t i = 0; i < edges.size(); ++i) {
    if (!tool_of(i).pose) continue;
    tell_touch(body_id, i, next);
  }
  tell_grips(std::span(reactions).subspan(of_touches));
  for (auto& [kind, text] : body.watch_numerics()) say(kind, body_id, 0, std::move(text));
}

void Simulation::State::tell_grips(std::span<const Reaction> of_grips) {
  for (Tool& tool : tools) {
    tool.grip.felt(of_grips.first(tool.grip_constraints));
    of_grips = of_grips.subspan(tool.grip_constraints);
  }
}

// Takes its reactions from `next` on.
void Simulation::State::tell_touch(std::uint32_t body_id, std::uint32_t edge_id, std::size_t& next) {
  EdgeContact& t = touch(body_id, edge_id);
  Reaction reaction;
  for (std::size_t i = 0; i < t.constraints().size(); ++i, ++next) {
    reaction.force_on_tool_n += reactions[next].force_on_tool_n;
    reaction.active |= reactions[next].active;
  }
  t.deformed(reaction, scene.step_s);
  for (const auto& [kind, text] : t.take_events()) {
    say(kind, body_id, edges[edge_id].tool_id, std::string(text));
    output.publish_now |= kind == EventKind::contact_began;
  }
}

void Simulation::State::split(std::uint32_t body_id) {
  const auto next_id = static_cast<std::uint32_t>(bodies.size());
  const auto room = static_cast<std::uint32_t>(kMostBodies - std::min(kMostBodies, bodies.size()));
  Split split = split_body(*bodies[body_id], scene, next_id, room, part_specs);
  for (std::size_t n = 0; n < split.parts.size(); ++n)
    for (Tool& tool : tools) tool.grip.part_left(body_id, *split.parts[n], split.vertex_from[n]);
  for (TopologyDelta& delta : split.deltas) {
    tell_touches(body_id, delta);
    changed_topology(body_id, std::move(delta));
  }
  for (auto& part : split.parts) add_part(std::move(part), body_id);
  for (const double volume_m3 : split.removed_m3) {
    output.report.removed_volume_m3 += volume_m3;
    char text[64];
    std::snprintf(text, sizeof text, "%.3g mm3", volume_m3 * 1e9);
    say(EventKind::fragment_removed, body_id, 0, text);
  }
}

void Simulation::State::add_part(std::unique_ptr<Body> part, std::uint32_t parent_id) {
  const char* kind = part->rigid ? "rigid" : part->spec.fixed ? "anchored" : "deformable";
  say(EventKind::body_split, parent_id, 0, part->spec.name + ", " + kind);
  output.new_bodies.push_back({part->id, parent_id, part->spec.name});
  output.publish_now = true;
  add_touches(*part);
  checks.emplace_back(part->spec);
  bodies.push_back(std::move(part));
  stirred.push_back(1);
}

void Simulation::State::follow_hands() {
  for (Tool& tool : tools)
    if (tool.pose) tool.grip.follow(*tool.pose, bodies);
}

void Simulation::State::move_rigid_pieces() {
  grips.clear();
  for (Tool& tool : tools) tool.grip_constraints = tool.pose ? tool.grip.append(bodies, grips) : 0;
  rigid_touches.clear();
  for (const GraspConstraint& grip : grips) stirred[grip.body_id] = 1;
  for (std::uint32_t b = 0; b < bodies.size(); ++b)
    for (std::uint32_t i = 0; bodies[b]->rigid && i < edges.size(); ++i) {
      stirred[b] |= touch(b, i).state() != ContactState::free;
      for (const PointConstraint& c : touch(b, i).constraints())
        rigid_touches.push_back({b, c, tool_of(i).velocity_m_per_s});
    }
  reactions.assign(rigid_touches.size() + grips.size(), {});
  step_rigid_pieces(bodies, {rigid_touches, grips, stirred}, scene, reactions);
  tell_grips(std::span(reactions).subspan(rigid_touches.size()));
  std::size_t next = 0;
  for (std::uint32_t b = 0; b < bodies.size(); ++b)
    for (std::uint32_t i = 0; bodies[b]->rigid && i < edges.size(); ++i)
      if (tool_of(i).pose) tell_touch(b, i, next);
}

void Simulation::State::tell_of_grips() {
  for (std::uint32_t i = 0; i < tools.size(); ++i)
    for (const auto& [kind, body_id, text] : tools[i].grip.take_events()) say(kind, body_id, i, std::string(text));
}

void Simulation::State::fit_contact_models() {
  bool in_contact = false;
  for (std::uint32_t i = 0; i < tools.size(); ++i) {
    if (!tools[i].pose) continue;
    ContactStep step = tools[i].contact(output.sim_time_s);
    for (std::uint32_t b = 0; b < bodies.size(); ++b)
      for (std::uint32_t e = 0; e < edges.size(); ++e)
        if (edges[e].tool_id == i) feel(touch(b, e), step);
    in_contact |= step.state != ContactState::free;
    output.contacts.push_back(tools[i].fitter.fit(step));
  }
  if (in_contact) output.report.contact_time_s += scene.step_s;
}

Simulation::Simulation(const Scene& scene) : Simulation(scene, standard_engines()) {}
Simulation::Simulation(const Scene& scene, const EngineTable& engines)
    : state_(std::make_unique<State>(scene, engines)) {}
Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;

const StepOutput& Simulation::step(const StepInput& input) {
  State& s = *state_;
  StepOutput& out = s.output;
  ++out.step;
  out.sim_time_s = static_cast<double>(out.step) * s.scene.step_s;
  out.deltas.clear();
  out.new_bodies.clear();
  out.contacts.clear();
  out.events.clear();
  out.publish_now = false;
  s.spare_idle_bodies = input.spare_idle_bodies;
  if (!input.overrun.empty()) s.say(EventKind::step_overrun, 0, 0, input.overrun);
  s.take(input);
  s.follow_hands();
  const bool turned = s.gravity.step(input, out);
  if (turned) feel_gravity(s.bodies, s.scene.gravity_m_per_s2 = s.gravity.now());
  const auto bodies_before = static_cast<std::uint32_t>(s.bodies.size());  // of which parts may come off
  s.stirred.assign(bodies_before, 0);
  for (std::uint32_t b = 0; b < bodies_before; ++b) s.step_and_check(b, turned);
  for (std::uint32_t b = bodies_before; b < s.bodies.size(); ++b)
    if (!s.bodies[b]->rigid) s.deform(b);
  s.move_rigid_pieces();
  s.tell_of_grips();
  s.fit_contact_models();

  out.report.local_searches = out.report.global_searches = 0;
  out.report.penetration_m = 0;
  report(s.bodies, s.checks, s.scene.step_s, out.report);
  out.report.instrument_work_j = s.contact_work_j;
  for (EdgeContact& t : s.touches) {
    out.report.instrument_work_j += t.cutting_work_j();
    out.report.local_searches += t.local_searches();
    out.report.global_searches += t.global_searches();
    out.report.penetration_m = std::max(out.report.penetration_m, t.penetration_m());
  }
  return out;
}

void Simulation::measure_with(double (*processor_s)()) {
  state_->processor_s = processor_s;
}

std::uint32_t Simulation::body_count() const {
  return static_cast<std::uint32_t>(state_->bodies.size());
}
const TriangleMesh& Simulation::mesh(std::uint32_t body_id) const {
  return state_->bodies[body_id]->mesh;
}
const BodySpec& Simulation::body(std::uint32_t body_id) const {
  return state_->bodies[body_id]->spec;
}
std::uint32_t Simulation::region_of(std::uint32_t body_id, VertexId v) const {
  return region_at(body(body_id).regions, mesh(body_id).rest_body_m(v));
}
RegionVolumes Simulation::region_volumes(std::uint32_t body_id) const {
  return sectio::region_volumes(body(body_id).regions, mesh(body_id).rest_body_m(), mesh(body_id).triangles());
}
ContactGap Simulation::contact_gap(std::uint32_t body_id) const {
  ContactGap deepest;
  for (std::uint32_t i = 0; i < state_->edges.size(); ++i)
    if (const ContactGap gap = state_->touch(body_id, i).gap(); gap.depth_m > deepest.depth_m) deepest = gap;
  return deepest;
}
bool Simulation::asleep(std::uint32_t body_id) const {
  return state_->bodies[body_id]->asleep();
}
const RigidBody* Simulation::rigid_body(std::uint32_t body_id) const {
  const auto& rigid = state_->bodies[body_id]->rigid;
  return rigid ? &rigid->body : nullptr;
}
std::size_t Simulation::copy_bytes(std::uint32_t body_id) const {
  return state_->bodies[body_id]->bytes();
}
std::span<const Vec3f> Simulation::positions_world_m(std::uint32_t body_id) const {
  return state_->bodies[body_id]->positions_world_m();
}
double Simulation::energy_j() const {
  double energy = 0;
  for (const auto& body : state_->bodies) energy += body->energy_j(state_->scene.gravity_m_per_s2);
  return energy;
}
const std::optional<JointPose>& Simulation::tool_pose_world(std::uint32_t tool_id) const {
  return state_->tools[tool_id].pose;
}

}  // namespace sectio

#include "sim_server/world/world.h"

#include <algorithm>
#include <deque>
#include <string>
#include <utility>

#include "common/core/error.h"
#include "sim_server/body_contact/body_overlap.h"
#include "sim_server/collision/surface_tree.h"

namespace sectio {

namespace {

BodySpec spec_of_part(const BodySpec& parent, std::uint32_t part, bool anchored) {
  BodySpec spec = parent;
  spec.mesh = {};
  spec.tets = {};
  spec.mesh_notes.clear();
  const std::string number = std::to_string(part);
  spec.name.resize(std::min(spec.name.size(), kMaxNameBytes - number.size() - 1));
  spec.name.append(1, '.').append(number);
  if (anchored) return spec;
  spec.fixed.reset();
  if (spec.splitting.free_parts == FreeParts::rigid) {
    spec.material.friction = spec.splitting.friction;
    spec.contact.style = "vertices";
  }
  return spec;
}

// A part of `one` lies in `other`, deeper than where bodies touch.
bool reaches_into(Body& one, Body& other) {
  const SurfaceView& view = one.view();
  const Box3 box = other.bounds_world_m();
  for (VertexId v = 0; v < view.mesh.vertex_slots(); ++v) {
    const Vec3 p = view.positions_world_m[v].cast<double>();
    if (!view.mesh.vertex_alive(v) || !box.contains(p) || !other.tree().inside(other.view(), p)) continue;
    if (!other.tree().closest(other.view(), p, kTouchReach_m)) return true;
  }
  return false;
}

}  // namespace

SimulatedWorld::SimulatedWorld(const Scene& s, const EngineTable& engines)
    : scene(s), gravity(scene), engines_(engines) {
  for (std::uint32_t i = 0; i < scene.bodies.size(); ++i) {
    const ModelEntry* model = engines.find_model(scene.bodies[i].model);
    if (!model)
      throw InputError(scene.file + ": bodies[" + std::to_string(i) + "].model: there are no engines for " +
                       scene.bodies[i].model);
    if (model->traits.needs_volume && scene.bodies[i].tets.tetrahedra.empty())
      throw InputError(place_of(scene.bodies[i], scene) + " has no volume: see prepared()");
    bodies.push_back(std::make_unique<Body>(scene.bodies[i], scene, i, model->make));
  }
  for (std::uint32_t i = 0; i < scene.tools.size(); ++i) tools.emplace_back(i, scene);
  for (std::uint32_t i = 0; i < scene.tools.size(); ++i)
    for (std::size_t e = 0; e < instrument_of(scene.tools[i].kind).edges; ++e) edges.push_back({i, e});
  for (auto& body : bodies) add_contacts(*body);
  for (const auto& body : bodies) checks.emplace_back(body->spec);
  add_processes();
  find_nested();
}

void SimulatedWorld::find_nested() {
  for (std::uint32_t a = 0; a < bodies.size(); ++a)
    for (std::uint32_t b = a + 1; b < bodies.size(); ++b) {
      Body &one = *bodies[a], &other = *bodies[b];
      if (!one.deforms() || !other.deforms() || !one.spec.fixed || !other.spec.fixed) continue;
      if (reaches_into(one, other) || reaches_into(other, one)) nested_.emplace(a, b);
    }
}

std::vector<BodyOverlap> SimulatedWorld::overlaps() const {
  std::vector<BodyOverlap> found;
  std::deque<SurfaceTree> trees;  // a body's own one is part of its state
  for (const auto& body : bodies) trees.emplace_back(body->view());
  for (std::uint32_t a = 0; a < bodies.size(); ++a) {
    Body& one = *bodies[a];
    if (const std::size_t sunken = sunken_skin({one.view(), trees[a]})) found.push_back({a, a, 0, sunken});
    for (std::uint32_t b = a + 1; b < bodies.size(); ++b) {
      Body& other = *bodies[b];
      const Box3 box = trees[a].bounds_world_m();
      if (are_nested(one, other) || box.isEmpty() || !box.intersects(trees[b].bounds_world_m())) continue;
      const auto [deepest_m, come_through] = overlap_of({one.view(), trees[a]}, {other.view(), trees[b]});
      if (deepest_m > 0 || come_through > 0) found.push_back({a, b, deepest_m, come_through});
    }
  }
  return found;
}

std::uint32_t SimulatedWorld::family_of(std::uint32_t body_id) const {
  while (body_id >= scene.bodies.size()) body_id = origins_[body_id - scene.bodies.size()].parent_id;
  return body_id;
}

bool SimulatedWorld::are_nested(const Body& one, const Body& other) const {
  return one.spec.fixed && other.spec.fixed && nested_.contains(std::minmax(family_of(one.id), family_of(other.id)));
}

void SimulatedWorld::add_contacts(Body& body) {
  for (std::uint32_t i = 0; i < edges.size(); ++i)
    contacts.emplace_back(InstrumentEdge(i, scene.tools[edges[i].tool_id], edges[i].index), body, scene.step_s);
}

void SimulatedWorld::add_processes() {
  processes_in_.resize(bodies.size());
  for (const ProcessSpec& spec : scene.processes) {
    const ProcessEntry* entry = engines_.find_process(spec.kind);
    if (!entry) throw InputError(scene.file + ": processes: " + spec.name + ": there is no engine for " + spec.kind);
    Interaction sees;
    for (const std::string& name : spec.bodies) {
      const auto body = std::ranges::find(bodies, name, [](const auto& b) { return b->spec.name; });
      if (body == bodies.end())
        throw InputError(scene.file + ": processes: " + spec.name + ": no body is named " + name);
      sees.bodies.push_back((*body)->id);
    }
    if (entry->in_body) {
      for (const std::uint32_t b : sees.bodies) {
        Body& body = *bodies[b];
        body.engines.processes.push_back(entry->in_body({spec, scene, body.shared(), body.frame_world(0)}));
        processes_in_[b].push_back(&spec);
      }
    } else {
      std::vector<SharedBody> shared;
      for (const std::uint32_t b : sees.bodies) shared.push_back(bodies[b]->shared());
      sees.engine = entry->between({spec, scene, shared});
      interactions.push_back(std::move(sees));
    }
  }
}

const BodySpec& SimulatedWorld::add_part_spec(Body& parent, bool anchored) {
  return part_specs.emplace_back(spec_of_part(parent.spec, ++parent.parts_made, anchored));
}

void SimulatedWorld::add_part(std::unique_ptr<Body> part, Body& parent, std::span<const VertexId> vertex_from) {
  origins_.push_back({parent.id, parent.parts_made, part->spec.fixed.has_value(), part->rigid() != nullptr,
                      part->frame_at_first_world()});
  add(std::move(part), parent, vertex_from, false);
}

void SimulatedWorld::archive(Archive& a) {
  a(scene.gravity_m_per_s2, gravity, contact_work_j, stuck, origins_);
  for (std::size_t n = 0; a.reads() && n < origins_.size(); ++n) {
    const Origin& from = origins_[n];
    if (from.parent_id >= bodies.size()) throw InputError("a part came off a body that isn't there");
    Body& parent = *bodies[from.parent_id];
    const BodySpec& spec = part_specs.emplace_back(spec_of_part(parent.spec, from.number, from.anchored));
    add(std::make_unique<Body>(spec, scene, static_cast<std::uint32_t>(bodies.size()), parent.make_engines(),
                               Body::Unread{from.frame_at_first_world, from.rigid}),
        parent, {}, true);
  }
  for (auto& body : bodies) body->archive(a);
  for (Tool& tool : tools) a(tool);
  for (EdgeContact& contact : contacts) a(contact);
  for (ModelCheck& check : checks) a(check);
  for (Interaction& between : interactions) {
    a(between.bodies);
    between.engine->archive(a);
  }
}

void SimulatedWorld::add(std::unique_ptr<Body> part, Body& parent, std::span<const VertexId> vertex_from,
                         bool is_unread) {
  add_contacts(*part);
  for (std::uint32_t e = 0; e < edges.size(); ++e)
    contacts[contacts.size() - edges.size() + e].arrive_with(contact(parent.id, e));
  checks.emplace_back(part->spec);
  processes_in_.push_back(processes_in_[parent.id]);
  const auto& named = processes_in_.back();
  const std::size_t first = parent.engines.processes.size() - named.size();
  for (std::size_t i = 0; i < named.size(); ++i)
    part->engines.processes.push_back(
        engines_.find_process(named[i]->kind)
            ->in_body({*named[i], scene, part->shared(), part->frame_world(0),
                       is_unread ? nullptr : parent.engines.processes[first + i].get(), vertex_from}));
  bodies.push_back(std::move(part));
}

bool SimulatedWorld::is_moved_from_outside(std::uint32_t body_id) const {
  return std::ranges::any_of(interactions,
                             [&](const Interaction& b) { return b.engine->moves_particles() && b.covers(body_id); });
}

std::vector<ScalarField> SimulatedWorld::scalars(std::uint32_t body_id) {
  std::vector<ScalarField> fields;
  Body& body = *bodies[body_id];
  body.engines.publish(body.shared(), fields);
  for (const Interaction& b : interactions)
    if (b.covers(body_id)) b.engine->publish(body.shared(), fields);
  if (fields.size() > kMaxScalars) fields.resize(kMaxScalars);
  for (ScalarField& field : fields) field.values.resize(body.mesh.vertex_slots(), field.least);
  return fields;
}

}  // namespace sectio

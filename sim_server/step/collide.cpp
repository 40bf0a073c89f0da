#include "sim_server/step/collide.h"

#include <algorithm>
#include <map>

#include "sim_server/body_contact/contact_solver.h"
#include "sim_server/body_contact/find_bodies.h"
#include "sim_server/body_contact/find_floor.h"
#include "sim_server/step/step.h"

namespace sectio {
namespace {

constexpr int kVelocitySweeps = 30, kDepthSweeps = 10;

using Bodies = std::span<const std::unique_ptr<Body>>;

// A body that moves as a whole.
struct Whole {
  Body& body;
  RigidMotion& motion;
};
std::vector<Whole> wholes_of(Bodies bodies) {
  std::vector<Whole> wholes;
  for (const auto& body : bodies)
    if (RigidMotion* motion = body->rigid(); motion && !body->frozen) wholes.push_back({*body, *motion});
  return wholes;
}

Box3 box_around(Body& body, double margin_m) {
  if (const RigidMotion* rigid = body.rigid()) {
    const Vec3& centre = rigid->body.pose_world().position_m;
    const Vec3 reach = Vec3::Constant(margin_m + rigid->radius_m());
    return {centre - reach, centre + reach};
  }
  const Box3 box = body.tree().bounds_world_m();
  const Vec3 reach = Vec3::Constant(margin_m);
  return box.isEmpty() ? box : Box3(box.min() - reach, box.max() + reach);
}

void wake_neighbours(Bodies bodies, std::span<const std::uint8_t> disturbed) {
  for (const auto& body : bodies) {
    if (!body->asleep()) continue;
    for (std::size_t other = 0; other < disturbed.size() && body->asleep(); ++other)
      if (disturbed[other] && box_around(*body, kTouchReach_m).intersects(box_around(*bodies[other], kTouchReach_m)))
        body->wake();
  }
}

// The body below a sleeping piece goes on feeling its weight.
void apply_resting_loads(Bodies bodies, const Body& sleeping, double step_s) {
  std::vector<NodeShare> nodes;
  std::map<std::uint32_t, std::vector<NodeChange>> changes;  // by body
  for (const VertexImpulse& load : sleeping.resting_loads) {
    const Body& support = *bodies[load.body];
    if (support.stands_still() || load.vertex >= support.mesh.vertex_slots() || !support.mesh.vertex_alive(load.vertex))
      continue;
    const DeformationEngine& deformation = *support.engines.deformation;
    deformation.nodes_of(load.vertex, nodes);
    for (const NodeShare& share : nodes) {
      const NodeMotion motion = deformation.node(support.particle_view(), share.node);
      const Vec3 gained = share.weight * motion.inverse_mass_per_kg * load.impulse_n_s;
      changes[load.body].push_back({share.node, gained, step_s * gained});
    }
  }
  for (const auto& [b, of_body] : changes) bodies[b]->nudge(of_body);
}

// A body that sleeps or is spared can't be moved; a sleeping one wakes when another bumps into it.
void find_pair(Body& body, Body& other, double reach_m, std::vector<BodyContact>& contacts) {
  const std::size_t from = contacts.size();
  find_body_contacts({body.view(), body.tree()}, {other.view(), other.tree()}, reach_m, contacts);
  for (std::size_t i = from; i < contacts.size(); ++i) {
    BodyContact& c = contacts[i];
    if (!other.asleep() && !other.spared) return;
    if (other.asleep() &&
        -body.velocity_at(c.one.v, c.one.weights, c.point_world_m).dot(c.normal_world) > kWaking_m_per_s)
      other.wake();
    else
      c.other.body = kImmovable;
  }
}

// Contacts with the floor and with other bodies; two that both move as a whole meet once.
void find_contacts(Bodies bodies, const Whole& whole, const Scene& scene, std::vector<BodyContact>& contacts) {
  const std::size_t from = contacts.size();
  Body& body = whole.body;
  const double reach_m = kTouchReach_m + 2 * scene.step_s * whole.motion.body.velocity_m_per_s().norm();
  if (scene.floor_z_m) find_floor_contacts(body.positions_world_m(), *scene.floor_z_m, reach_m, body.id, contacts);
  for (const auto& other : bodies) {
    const bool moves_as_well = other->rigid() && !other->frozen && !other->asleep();
    if (other->id == body.id || (moves_as_well && other->id < body.id)) continue;
    if (box_around(body, reach_m).intersects(box_around(*other, 0))) find_pair(body, *other, reach_m, contacts);
  }
  for (std::size_t i = from; i < contacts.size(); ++i) contacts[i].friction = body.spec.splitting.friction;
}

std::vector<std::uint8_t> supported_bodies(std::size_t count, std::span<const BodyContact> contacts, std::size_t from,
                                           const ContactSolver& solver) {
  std::vector<std::uint8_t> supported(count, 0);
  for (std::size_t i = from; i < contacts.size(); ++i)
    for (const std::uint32_t b : {contacts[i].one.body, contacts[i].other.body})
      if (b != kImmovable && solver.depth_m(i) >= -kTouchReach_m) supported[b] = 1;
  return supported;
}

void keep_resting_loads(Body& body, std::span<const BodyContact> contacts, const ContactSolver& solver) {
  body.resting_loads.clear();
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (contacts[i].one.body != body.id && contacts[i].other.body != body.id) continue;
    const auto loads = solver.impulses_on_vertices(i);
    body.resting_loads.insert(body.resting_loads.end(), loads.begin(), loads.end());
  }
}

}  // namespace

void collide_bodies(Bodies bodies, std::span<const std::uint8_t> disturbed, const Scene& scene) {
  wake_neighbours(bodies, disturbed);
  if (std::ranges::all_of(bodies, [](const auto& b) { return b->deforms(); })) return;
  std::vector<BodyContact> contacts;
  const std::vector<Whole> wholes = wholes_of(bodies);
  for (const Whole& whole : wholes) whole.motion.append_contacts(whole.body.id, contacts);
  const std::size_t of_instruments = contacts.size();
  for (const Whole& whole : wholes)
    if (whole.body.asleep()) apply_resting_loads(bodies, whole.body, scene.step_s);
  for (const Whole& whole : wholes)
    if (!whole.body.asleep()) whole.motion.push_by_gravity();
  for (const Whole& whole : wholes)
    if (!whole.body.asleep()) find_contacts(bodies, whole, scene, contacts);

  std::vector<ContactBody> sides;
  for (const auto& body : bodies) sides.push_back(body->contact_body());
  ContactSolver solver(sides, contacts, scene.step_s);
  solver.solve(kVelocitySweeps);
  solver.undo_depths(kDepthSweeps);
  for (const auto& body : bodies) body->nudge(solver.changes_of(body->id));
  std::size_t contact = 0;
  for (const Whole& whole : wholes)
    for (std::size_t i = 0; i < whole.motion.constraints().size(); ++i)
      whole.motion.react(i, solver.impulse_on_other_n_s(contact++));
  const auto supported = supported_bodies(bodies.size(), contacts, of_instruments, solver);
  for (const auto& [body, motion] : wholes) {
    if (body.asleep()) continue;
    motion.move(body.shared(), supported[body.id] != 0);
    body.particles_moved();
    if (body.asleep()) keep_resting_loads(body, contacts, solver);
  }
}

void collide(SimulatedWorld& world, StepContext& context) {
  std::vector<std::uint8_t> disturbed;
  for (const BodyStep& body : context.bodies) disturbed.push_back(body.disturbed);
  collide_bodies(world.bodies, disturbed, world.scene);
  for (std::uint32_t b = 0; b < world.bodies.size(); ++b)
    if (const RigidMotion* rigid = world.bodies[b]->rigid())
      world.bodies[b]->frozen ? distribute_reactions(world, context, b, {}, {})
                              : distribute_reactions(world, context, b, rigid->constraints(), rigid->reactions());
}

}  // namespace sectio

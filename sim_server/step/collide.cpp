#include "sim_server/step/collide.h"

#include <algorithm>

#include "sim_server/body_contact/contact_solver.h"
#include "sim_server/body_contact/find_bodies.h"
#include "sim_server/body_contact/find_floor.h"
#include "sim_server/step/step.h"

namespace sectio {
namespace {

constexpr double kReachM = 2e-4;              // a gap that counts as contact; faster pieces see further
constexpr double kWakingSpeedM_per_s = 0.02;  // of a piece that bumps into a sleeping one
constexpr int kVelocitySweeps = 30, kDepthSweeps = 10;

using Bodies = std::span<const std::unique_ptr<Body>>;

// A part that came off and goes on deforming; its engine keeps it above the floor.
bool is_loose(const Body& body, const Scene& scene) {
  return !body.rigid() && body.id >= scene.bodies.size() && !body.spec.fixed;
}
bool moves(const Body& body, const Scene& scene) {
  return (body.rigid() || is_loose(body, scene)) && !body.frozen && !body.asleep();
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
      if (disturbed[other] && box_around(*body, kReachM).intersects(box_around(*bodies[other], kReachM))) body->wake();
  }
}

// The body below a sleeping piece goes on feeling its weight.
void apply_resting_loads(Bodies bodies, const Body& sleeping, double step_s) {
  for (const ParticleImpulse& load : sleeping.resting_loads) {
    Body& support = *bodies[load.body];
    if (support.frozen || support.asleep() || load.vertex >= support.mesh.vertex_slots() ||
        !support.mesh.vertex_alive(load.vertex))
      continue;
    const Vec3 gained = support.engines.deformation->inverse_mass_per_kg(load.vertex) * load.impulse_n_s;
    support.nudge(load.vertex, gained, step_s * gained);
  }
}

Vec3 velocity_of(const Body& body, const ContactSide& side, const Vec3& point_world_m) {
  if (body.rigid()) return body.rigid()->body.velocity_at(point_world_m);
  Vec3 velocity = Vec3::Zero();
  for (std::size_t a = 0; a < side.v.size(); ++a)
    if (side.v[a] != kNone) velocity += side.weights[static_cast<int>(a)] * body.particle_view().velocity(side.v[a]);
  return velocity;
}

// A sleeping body can't be moved; it wakes when another bumps into it.
void find_pair(Body& body, Body& other, double reach_m, std::vector<BodyContact>& contacts) {
  const std::size_t from = contacts.size();
  find_body_contacts({body.view(), body.tree()}, {other.view(), other.tree()}, reach_m, contacts);
  for (std::size_t i = from; i < contacts.size(); ++i) {
    BodyContact& c = contacts[i];
    if (!other.asleep()) return;
    if (-velocity_of(body, c.one, c.point_world_m).dot(c.normal_world) > kWakingSpeedM_per_s)
      other.wake();
    else
      c.other.body = kImmovable;
  }
}

// Contacts of a body that moves with the floor and with other bodies; two bodies that both move meet once.
void find_contacts(Bodies bodies, Body& body, const Scene& scene, std::vector<BodyContact>& contacts) {
  const std::size_t from = contacts.size();
  const double speed_m_per_s = body.rigid() ? body.rigid()->body.velocity_m_per_s().norm() : 0;
  const double reach_m = kReachM + 2 * scene.step_s * speed_m_per_s;
  if (body.rigid() && scene.floor_z_m)
    find_floor_contacts(body.positions_world_m(), *scene.floor_z_m, reach_m, body.id, contacts);
  for (const auto& other : bodies) {
    if (other->id == body.id || (moves(*other, scene) && other->id < body.id)) continue;
    if (box_around(body, reach_m).intersects(box_around(*other, 0))) find_pair(body, *other, reach_m, contacts);
  }
  for (std::size_t i = from; i < contacts.size(); ++i) contacts[i].friction = body.spec.splitting.friction;
}

std::vector<std::uint8_t> supported_bodies(std::size_t count, std::span<const BodyContact> contacts, std::size_t from,
                                           const ContactSolver& solver) {
  std::vector<std::uint8_t> supported(count, 0);
  for (std::size_t i = from; i < contacts.size(); ++i)
    for (const std::uint32_t b : {contacts[i].one.body, contacts[i].other.body})
      if (b != kImmovable && solver.depth_m(i) >= -kReachM) supported[b] = 1;
  return supported;
}

void keep_resting_loads(Body& body, std::span<const BodyContact> contacts, const ContactSolver& solver) {
  body.resting_loads.clear();
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (contacts[i].one.body != body.id && contacts[i].other.body != body.id) continue;
    const auto loads = solver.impulses_on_particles(i);
    body.resting_loads.insert(body.resting_loads.end(), loads.begin(), loads.end());
  }
}

}  // namespace

void collide_bodies(Bodies bodies, std::span<const std::uint8_t> disturbed, const Scene& scene) {
  if (std::ranges::none_of(bodies, [&](const auto& b) { return b->rigid() || b->id >= scene.bodies.size(); })) return;
  wake_neighbours(bodies, disturbed);
  std::vector<BodyContact> contacts;
  for (const auto& body : bodies)
    if (body->rigid() && !body->frozen) body->rigid()->append_contacts(body->id, contacts);
  const std::size_t of_instruments = contacts.size();
  for (const auto& body : bodies)
    if (body->rigid() && body->asleep()) apply_resting_loads(bodies, *body, scene.step_s);
  for (const auto& body : bodies)
    if (body->rigid() && !body->asleep() && !body->frozen) body->rigid()->push_by_gravity();
  for (const auto& body : bodies)
    if (moves(*body, scene)) find_contacts(bodies, *body, scene, contacts);

  std::vector<ContactBody> sides;
  for (const auto& body : bodies) sides.push_back(body->contact_body());
  ContactSolver solver(sides, contacts, scene.step_s);
  solver.solve(kVelocitySweeps);
  solver.undo_depths(kDepthSweeps);
  for (const ParticleChange& p : solver.particle_changes())
    bodies[p.body]->nudge(p.vertex, p.faster_by_m_per_s, p.moved_by_m);
  for (std::size_t i = 0, of_body = 0; i < of_instruments; ++i) {
    of_body = i > 0 && contacts[i].one.body == contacts[i - 1].one.body ? of_body + 1 : 0;
    bodies[contacts[i].one.body]->rigid()->react(of_body, solver.impulse_on_other_n_s(i));
  }
  const auto supported = supported_bodies(bodies.size(), contacts, of_instruments, solver);
  for (const auto& body : bodies) {
    if (!body->rigid() || !moves(*body, scene)) continue;
    body->move_rigid(supported[body->id] != 0);
    if (body->asleep()) keep_resting_loads(*body, contacts, solver);
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

#include "sim_server/step/collide.h"

#include <algorithm>

#include "sim_server/body_contact/body_contact.h"
#include "sim_server/body_contact/contact_solver.h"
#include "sim_server/step/step.h"
#include "sim_server/step/touched_particles.h"

namespace sectio {
namespace {

constexpr double kReachM = 2e-4;              // a gap that counts as contact; faster pieces see further
constexpr double kWakingSpeedM_per_s = 0.02;  // of a piece that bumps into a sleeping one
constexpr double kGraspFollows = 0.5;         // of the way to where jaws hold a point, in one step
constexpr double kToolSpeedM_per_s = 1;       // at which a piece gives way to an instrument

class RigidStep {
 public:
  RigidStep(std::span<const std::unique_ptr<Body>> bodies, const Scene& scene)
      : bodies_(bodies),
        scene_(scene),
        dynamics_(bodies.size(), nullptr),
        supported_(bodies.size(), 0),
        particles_(bodies) {
    for (std::size_t b = 0; b < bodies.size(); ++b)
      if (bodies[b]->rigid) dynamics_[b] = &bodies[b]->rigid->body;
  }

  void run(const RigidInput& input, std::span<Reaction> reactions) {
    if (!input.disturbed.empty()) wake(input.disturbed);
    for (const RigidTouch& touch : input.touches) add_tool(touch);
    for (const GraspConstraint& grip : input.grips) add_grip(grip);
    for (std::uint32_t b = 0; b < bodies_.size(); ++b)
      if (dynamics_[b] && bodies_[b]->asleep()) bear(b);
    for (RigidBody* piece : dynamics_)
      if (piece && !piece->asleep()) piece->push(scene_.gravity_m_per_s2, scene_.step_s);
    for (std::uint32_t b = 0; b < bodies_.size(); ++b)
      if (moves(b)) find(b);
    std::vector<Vec3> impulses(contacts_.size(), Vec3::Zero());
    const ContactSides sides{dynamics_, particles_.all()};
    solve_contacts(sides, contacts_, {scene_.step_s, 30}, impulses);
    undo_depths(sides, contacts_, {scene_.step_s, 10});
    particles_.give_back(scene_.step_s);
    for (std::size_t i = 0; i < reactions.size(); ++i) {
      reactions[i].force_on_tool_n = impulses[i] / scene_.step_s;
      reactions[i].active = !impulses[i].isZero(0);
    }
    for (std::uint32_t b = 0; b < bodies_.size(); ++b) {
      if (!dynamics_[b] || !moves(b)) continue;
      move(b);
      if (dynamics_[b]->asleep()) keep_bearing_on(b, impulses);
    }
  }

 private:
  // A part that came off and goes on deforming; its deformation engine deals with the floor.
  bool is_loose(std::uint32_t b) const { return !dynamics_[b] && b >= scene_.bodies.size() && !bodies_[b]->spec.fixed; }
  bool moves(std::uint32_t b) const {
    return (dynamics_[b] || is_loose(b)) && !bodies_[b]->frozen && !bodies_[b]->asleep();
  }

  Box3 box_around(std::uint32_t b, double margin_m) const {
    const Vec3 reach = Vec3::Constant(margin_m + (dynamics_[b] ? bodies_[b]->rigid->radius_m() : 0));
    if (dynamics_[b]) {
      const Vec3& centre = dynamics_[b]->pose_world().position_m;
      return {centre - reach, centre + reach};
    }
    const Box3 box = bodies_[b]->tree().bounds_world_m();
    return box.isEmpty() ? box : Box3(box.min() - reach, box.max() + reach);
  }

  void wake(std::span<const std::uint8_t> disturbed) {
    for (std::uint32_t b = 0; b < bodies_.size(); ++b) {
      if (!bodies_[b]->asleep()) continue;
      for (std::uint32_t other = 0; other < bodies_.size() && bodies_[b]->asleep(); ++other)
        if (disturbed[other] && box_around(b, kReachM).intersects(box_around(other, kReachM))) bodies_[b]->wake();
    }
  }

  void add_tool(const RigidTouch& touch) {
    Body& body = *bodies_[touch.body_id];
    RigidContact c;
    c.point_world_m.setZero();
    for (std::size_t a = 0; a < 3; ++a)
      c.point_world_m += touch.constraint.w[a] * body.particle_view().position(touch.constraint.v[a]);
    c.normal_world = -touch.constraint.normal;
    c.depth_m = (c.point_world_m - touch.constraint.target_world_m).dot(touch.constraint.normal);
    c.body = touch.body_id;
    c.surface_velocity_m_per_s = touch.tool_velocity_m_per_s;
    c.largest_speed_m_per_s = kToolSpeedM_per_s;
    c.friction = body.spec.splitting.friction;
    if (c.depth_m > 0) body.rigid->body.wake();
    contacts_.push_back(c);
  }

  void add_grip(const GraspConstraint& grip) {
    RigidContact c;
    c.body = grip.body_id;
    c.point_world_m = grip.point_world_m;
    c.surface_velocity_m_per_s = kGraspFollows / scene_.step_s * (grip.to_world_m - grip.point_world_m);
    c.grip_n = grip.largest_force_n;
    dynamics_[c.body]->wake();
    contacts_.push_back(c);
  }

  void find(std::uint32_t b) {
    Body& body = *bodies_[b];
    const std::size_t from = contacts_.size();
    const double speed_m_per_s = dynamics_[b] ? dynamics_[b]->velocity_m_per_s().norm() : 0;
    const double reach_m = kReachM + 2 * scene_.step_s * speed_m_per_s;
    if (dynamics_[b] && scene_.floor_z_m)
      floor_contacts(body.positions_world_m(), {}, *scene_.floor_z_m, reach_m, b, contacts_);
    for (std::uint32_t other = 0; other < bodies_.size(); ++other) {
      if (other == b || (moves(other) && other < b)) continue;  // a pair that both move is met once
      if (!box_around(b, reach_m).intersects(box_around(other, 0))) continue;
      add_pair(b, other, reach_m);
    }
    for (std::size_t i = from; i < contacts_.size(); ++i) {
      contacts_[i].friction = body.spec.splitting.friction;
      if (contacts_[i].depth_m < -kReachM) continue;
      if (contacts_[i].body != kImmovable) supported_[contacts_[i].body] = 1;
      if (contacts_[i].other != kImmovable) supported_[contacts_[i].other] = 1;
    }
  }

  void add_pair(std::uint32_t b, std::uint32_t other, double reach_m) {
    found_.clear();
    find_contacts(bodies_[b]->view(), bodies_[other]->view(), bodies_[other]->tree(), reach_m, found_);
    const std::size_t own = found_.size();
    find_contacts(bodies_[other]->view(), bodies_[b]->view(), bodies_[b]->tree(), reach_m, found_);
    for (std::size_t i = 0; i < found_.size(); ++i) {
      const BodyContact& f = found_[i];
      RigidContact c;
      c.point_world_m = f.point_world_m;
      c.normal_world = i < own ? f.normal_world : Vec3(-f.normal_world);
      c.depth_m = f.depth_m;
      if (dynamics_[b])
        c.body = b;
      else
        join(c, b, f, i >= own, 1);
      if (bodies_[other]->asleep() && approach_m_per_s(b, f, i >= own, c) > kWakingSpeedM_per_s) bodies_[other]->wake();
      if (!bodies_[other]->asleep()) {
        if (dynamics_[other])
          c.other = other;
        else
          join(c, other, f, i < own, -1);
      }
      contacts_.push_back(c);
    }
  }

  void join(RigidContact& c, std::uint32_t b, const BodyContact& f, bool by_triangle, double side) {
    if (by_triangle)
      particles_.join(c, b, bodies_[b]->mesh.triangle(f.triangle).v, f.bary, side, scene_.step_s);
    else
      particles_.join(c, b, f.vertex, side, scene_.step_s);
  }

  // The speed at which a body bumps into another at a contact.
  double approach_m_per_s(std::uint32_t b, const BodyContact& f, bool by_triangle, const RigidContact& c) const {
    if (dynamics_[b]) return -dynamics_[b]->velocity_at(c.point_world_m).dot(c.normal_world);
    const ParticleView state = bodies_[b]->particle_view();
    if (!by_triangle) return -state.velocity(f.vertex).dot(c.normal_world);
    double speed_m_per_s = 0;
    for (std::size_t a = 0; a < 3; ++a)
      speed_m_per_s -=
          f.bary[static_cast<int>(a)] * state.velocity(bodies_[b]->mesh.triangle(f.triangle).v[a]).dot(c.normal_world);
    return speed_m_per_s;
  }

  // A sleeping piece goes on giving its last impulses to the body that it bears on.
  void keep_bearing_on(std::uint32_t b, std::span<const Vec3> impulses) {
    std::vector<RestingLoad>& loads = bodies_[b]->loads;
    loads.clear();
    for (std::size_t i = 0; i < contacts_.size(); ++i)
      if (contacts_[i].body == b || contacts_[i].other == b) particles_.loads_of(contacts_[i], impulses[i], loads);
  }
  void bear(std::uint32_t b) const {
    for (const RestingLoad& load : bodies_[b]->loads) {
      Body& bed = *bodies_[load.body_id];
      if (bed.frozen || bed.asleep() || load.vertex >= bed.mesh.vertex_slots() || !bed.mesh.vertex_alive(load.vertex))
        continue;
      const Vec3 gained = bed.engines.deformation->inverse_mass_per_kg(load.vertex) * load.impulse_n_s;
      bed.nudge(load.vertex, gained, scene_.step_s * gained);
    }
  }

  void move(std::uint32_t b) {
    dynamics_[b]->move(scene_.step_s);
    dynamics_[b]->rest(supported_[b] != 0, bodies_[b]->rigid->radius_m(), scene_.step_s);
    if (!dynamics_[b]->pose_world().position_m.allFinite() ||
        !dynamics_[b]->pose_world().orientation.coeffs().allFinite())
      bodies_[b]->frozen = true;
    else
      bodies_[b]->follow_rigid();
  }

  std::span<const std::unique_ptr<Body>> bodies_;
  const Scene& scene_;
  std::vector<RigidBody*> dynamics_;  // by body; none for those that deform
  std::vector<std::uint8_t> supported_;
  TouchedParticles particles_;
  std::vector<RigidContact> contacts_;
  std::vector<BodyContact> found_;
};

}  // namespace

void step_rigid_pieces(std::span<const std::unique_ptr<Body>> bodies, const RigidInput& input, const Scene& scene,
                       std::span<Reaction> reactions) {
  if (std::ranges::none_of(bodies, [&](const auto& b) { return b->rigid || b->id >= scene.bodies.size(); })) return;
  RigidStep(bodies, scene).run(input, reactions);
}

void collide(World& world, StepContext& context) {
  std::vector<GraspConstraint> grasps;
  for (std::uint32_t t = 0; t < world.tools.size(); ++t) {
    const std::size_t from = grasps.size();
    if (world.tools[t].pose) world.tools[t].grasp.append(world.bodies, grasps);
    for (std::size_t i = from; i < grasps.size(); ++i) grasps[i].tool_id = t;
  }
  for (const GraspConstraint& g : grasps) context.bodies[g.body_id].disturbed = true;

  std::vector<RigidTouch> touches;
  std::vector<PointConstraint> constraints;
  std::vector<std::size_t> first_of_body{0};  // of `constraints`
  for (std::uint32_t b = 0; b < world.bodies.size(); ++b) {
    for (std::uint32_t e = 0; world.bodies[b]->rigid && e < world.edges.size(); ++e) {
      const EdgeContact& contact = world.contact(b, e);
      context.bodies[b].disturbed |= contact.state() != ContactState::free;
      for (PointConstraint c : contact.constraints()) {
        c.source = e;
        constraints.push_back(c);
        touches.push_back({b, c, world.tool_of(e).velocity_m_per_s});
      }
    }
    first_of_body.push_back(constraints.size());
  }
  std::vector<std::uint8_t> disturbed;
  for (const BodyStep& body : context.bodies) disturbed.push_back(body.disturbed);
  std::vector<Reaction> reactions(touches.size() + grasps.size());
  step_rigid_pieces(world.bodies, {touches, grasps, disturbed}, world.scene, reactions);

  for (std::size_t i = 0; i < grasps.size(); ++i)
    world.tools[grasps[i].tool_id].grasp.felt(reactions[touches.size() + i]);
  for (std::uint32_t b = 0; b < world.bodies.size(); ++b) {
    if (!world.bodies[b]->rigid) continue;
    const std::size_t from = first_of_body[b], count = first_of_body[b + 1] - from;
    distribute_reactions(world, context, b, std::span(constraints).subspan(from, count),
                         std::span(reactions).subspan(from, count));
  }
}

}  // namespace sectio

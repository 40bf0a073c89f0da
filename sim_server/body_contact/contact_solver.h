// Solves contacts by impulses on velocities, one contact after the other, forwards and backwards (sequential impulses,
// Catto 2005), without restitution and with Coulomb's friction. Rigid bodies and particles of deforming bodies take
// part alike: one side gains the momentum that the other loses, and no contact adds kinetic energy. Deterministic.
//
//   ContactSolver solver(bodies, contacts, step_s);  // borrows the particles that contacts name
//   solver.solve(30);                                // velocities; those of rigid bodies are written at once
//   solver.undo_depths(10);
//   for (const ParticleChange& c : solver.particle_changes()) ...  // the particles' bodies get these back
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "sim_server/body_contact/body_contact.h"
#include "sim_server/body_contact/rigid_body.h"
#include "sim_server/deformation/deformation_engine.h"

namespace sectio {

// A body as the solver sees it: a rigid one, or the particles of one that deforms.
struct ContactBody {
  RigidBody* rigid = nullptr;  // when there is one, the rest is not used
  ParticleView particles = {};
  const DeformationEngine* deformation = nullptr;  // nullptr: contacts can't move the particles
};

// The change of a particle by contacts in a step.
struct ParticleChange {
  std::uint32_t body = 0;
  VertexId vertex = kNone;
  Vec3 faster_by_m_per_s = Vec3::Zero();
  Vec3 moved_by_m = Vec3::Zero();
};
// The impulse that a contact gave to a particle.
struct ParticleImpulse {
  std::uint32_t body = 0;
  VertexId vertex = kNone;
  Vec3 impulse_n_s = Vec3::Zero();

  template <class A>
  void archive(A& a) {
    a(body, vertex, impulse_n_s);
  }
};

class ContactSolver {
 public:
  // Borrows the particles that the contacts name. The bodies and the contacts outlive the solver.
  ContactSolver(std::span<const ContactBody> bodies, std::span<const BodyContact> contacts, double step_s);

  void solve(int sweeps);
  // Pushes overlapping bodies apart, a part of the depth at a time, without changing any velocity: depth is an error of
  // position, and an impulse that undid it would let bodies jump.
  void undo_depths(int sweeps);

  // Before particles moved in this step: contacts may still change that motion.
  double depth_m(std::size_t contact) const { return rows_[contact].depth_m; }
  Vec3 impulse_on_other_n_s(std::size_t contact) const { return -rows_[contact].impulse_n_s; }
  std::vector<ParticleImpulse> impulses_on_particles(std::size_t contact) const;
  // Changes of the particles to which contacts gave something: each moved by its change of velocity for one step, and
  // out of the body that it was in.
  std::vector<ParticleChange> particle_changes() const;

 private:
  struct Particle {
    std::uint32_t body;
    VertexId vertex;
    Vec3 velocity_before_m_per_s, velocity_m_per_s;
    double inverse_mass_per_kg;
    Vec3 shift_m = Vec3::Zero();  // out of the body that it was in
  };
  // A particle's weight in the point of a contact: positive on side `one`, negative on the other.
  struct Share {
    std::uint32_t particle;
    double weight;
  };
  // One contact: v = v_one - v_other + sum_a weight_a v_a at its point, J its transpose.
  struct Row {
    std::uint32_t one = kImmovable, other = kImmovable;  // rigid bodies
    std::array<Share, 4> shares;
    std::size_t share_count = 0;
    double depth_m = 0;
    Vec3 u, w;  // tangential directions
    double mass_n = 0, mass_u = 0, mass_w = 0;
    double target_m_per_s = 0;  // least velocity apart
    double normal_impulse_n_s = 0;
    Eigen::Vector2d friction_impulse_n_s = Eigen::Vector2d::Zero();
    Vec3 impulse_n_s = Vec3::Zero();  // in all

    std::span<const Share> particles() const { return {shares.data(), share_count}; }
  };
  class Drifts;

  std::uint32_t borrow(std::uint32_t body, VertexId v);
  void add_side(Row& row, const ContactSide& side, double sign, const BodyContact& contact);
  void drop_far_levers(Row& row, const BodyContact& contact) const;
  double mass_along(const Row& row, const Vec3& point_world_m, const Vec3& along) const;
  Vec3 velocity_apart(const Row& row, const BodyContact& contact) const;
  void push(Row& row, const BodyContact& contact, const Vec3& impulse_n_s);
  void solve_grip(Row& row, const BodyContact& contact);
  void solve_contact(Row& row, const BodyContact& contact);

  std::span<const ContactBody> bodies_;
  std::span<const BodyContact> contacts_;
  double step_s_;
  std::vector<Row> rows_;  // one a contact
  std::vector<Particle> particles_;
  std::map<std::pair<std::uint32_t, VertexId>, std::uint32_t> numbers_;  // the particles'
};

}  // namespace sectio

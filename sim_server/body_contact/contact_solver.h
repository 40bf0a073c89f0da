// Solves contacts by impulses on velocities, one contact after the other, forwards and backwards (sequential impulses,
// Catto 2005), without restitution and with Coulomb's friction. Rigid bodies and nodes of deforming bodies take part
// alike: one side gains the momentum that the other loses, and no contact adds kinetic energy. Deterministic.
//
//   ContactSolver solver(bodies, contacts, step_s);  // borrows the nodes that carry what contacts name
//   solver.solve(30);                                // velocities; those of rigid bodies are written at once
//   solver.undo_depths(10);
//   for (body ...) body.nudge(solver.changes_of(body));  // the nodes' bodies get these back
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

// A body as the solver sees it: a rigid one, or one that deforms.
struct ContactBody {
  RigidBody* rigid = nullptr;  // when there is one, the rest is not used
  ParticleView particles = {};
  const DeformationEngine* deformation = nullptr;  // nullptr: contacts can't move the body
};

// The impulse that a contact gave to a vertex.
struct VertexImpulse {
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
  // Borrows the nodes that carry what the contacts name. The bodies and the contacts outlive the solver.
  ContactSolver(std::span<const ContactBody> bodies, std::span<const BodyContact> contacts, double step_s);

  void solve(int sweeps);
  // Pushes overlapping bodies apart, a part of the depth at a time, without changing any velocity: depth is an error of
  // position, and an impulse that undid it would let bodies jump.
  void undo_depths(int sweeps);

  // The depth before nodes moved in this step: contacts may still change that motion.
  double depth_m(std::size_t contact) const { return rows_[contact].depth_m; }
  Vec3 impulse_on_other_n_s(std::size_t contact) const { return -rows_[contact].impulse_n_s; }
  std::vector<VertexImpulse> impulses_on_vertices(std::size_t contact) const;
  // Changes of a body's nodes to which contacts gave something: each moved by its change of velocity for one step, and
  // out of the body that it was in.
  std::vector<NodeChange> changes_of(std::uint32_t body) const;

 private:
  struct Node {
    std::uint32_t body, number;
    Vec3 velocity_before_m_per_s, velocity_m_per_s;
    double inverse_mass_per_kg;
    Vec3 shift_m = Vec3::Zero();  // out of the body that it was in
  };
  // A node's weight in the point of a contact: positive on side `one`, negative on the other.
  struct Share {
    std::uint32_t node;  // among those borrowed
    double weight;
  };
  static constexpr std::size_t kMostShares = 32;  // a vertex and a triangle with eight nodes a vertex
  // One contact: v = v_one - v_other + sum_a weight_a v_a at its point, J its transpose.
  struct Row {
    std::uint32_t one = kImmovable, other = kImmovable;  // rigid bodies
    std::array<Share, kMostShares> shares;
    std::size_t share_count = 0;
    double depth_m = 0;
    Vec3 u, w;  // tangential directions
    double mass_n = 0, mass_u = 0, mass_w = 0;
    double target_m_per_s = 0;  // least velocity apart
    double normal_impulse_n_s = 0;
    Eigen::Vector2d friction_impulse_n_s = Eigen::Vector2d::Zero();
    Vec3 impulse_n_s = Vec3::Zero();  // total impulse

    std::span<const Share> nodes() const { return {shares.data(), share_count}; }
  };
  class Drifts;

  std::uint32_t borrow(std::uint32_t body, std::uint32_t number);
  void add_share(Row& row, std::uint32_t node, double weight) const;
  void add_side(Row& row, const ContactSide& side, double sign, const BodyContact& contact);
  void drop_far_levers(Row& row, const BodyContact& contact) const;
  static void drop_if_together(Row& row);
  double mass_along(const Row& row, const Vec3& point_world_m, const Vec3& along) const;
  Vec3 velocity_apart(const Row& row, const BodyContact& contact) const;
  void push(Row& row, const BodyContact& contact, const Vec3& impulse_n_s);
  void solve_grip(Row& row, const BodyContact& contact);
  void solve_contact(Row& row, const BodyContact& contact);

  std::span<const ContactBody> bodies_;
  std::span<const BodyContact> contacts_;
  double step_s_;
  std::vector<Row> rows_;  // one a contact
  std::vector<Node> nodes_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> borrowed_;  // by body and the node's number there
  std::vector<NodeShare> carriers_;                                            // scratch
};

}  // namespace sectio

#include "sim_server/body_contact/contact_solver.h"

#include <algorithm>
#include <cmath>

#include "common/core/error.h"

namespace sectio {
namespace {

constexpr double kSlop_m = 5e-5;      // depth that is left, so that contacts last
constexpr double kDepthUndone = 0.2;  // share of the remaining depth that one step undoes
constexpr double kLongestLever = 20;  // the most speed that a node gains, over what its contact needs
constexpr double kTogether = 0.02;    // sum of the shares of a contact's nodes below which its sides move as one

}  // namespace

ContactSolver::ContactSolver(std::span<const ContactBody> bodies, std::span<const BodyContact> contacts, double step_s)
    : bodies_(bodies), contacts_(contacts), step_s_(step_s), rows_(contacts.size()) {
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const BodyContact& c = contacts_[i];
    Row& row = rows_[i];
    row.depth_m = c.depth_m;
    add_side(row, c.one, 1, c);
    add_side(row, c.other, -1, c);
    row.u = c.normal_world.unitOrthogonal();
    row.w = c.normal_world.cross(row.u);
    drop_far_levers(row, c);
    drop_if_together(row);
    row.mass_n = mass_along(row, c.point_world_m, c.normal_world);
    row.mass_u = mass_along(row, c.point_world_m, row.u);
    row.mass_w = mass_along(row, c.point_world_m, row.w);
    row.target_m_per_s = std::min(0.0, row.depth_m) / step_s_;  // a gap may close
  }
}

std::uint32_t ContactSolver::borrow(std::uint32_t body, std::uint32_t number) {
  const auto [it, is_new] = borrowed_.try_emplace({body, number}, static_cast<std::uint32_t>(nodes_.size()));
  if (is_new) {
    const ContactBody& owner = bodies_[body];
    const NodeMotion motion = owner.deformation ? owner.deformation->node(owner.particles, number)
                                                : NodeMotion{owner.particles.velocity(number), 0};
    nodes_.push_back({body, number, motion.velocity_m_per_s, motion.velocity_m_per_s, motion.inverse_mass_per_kg});
  }
  return it->second;
}

// Vertices of a triangle may share nodes.
void ContactSolver::add_share(Row& row, std::uint32_t node, double weight) const {
  const auto shares = std::span(row.shares).first(row.share_count);
  if (const auto at = std::ranges::find(shares, node, &Share::node); at != shares.end()) {
    at->weight += weight;
    return;
  }
  SECTIO_ASSERT(row.share_count < row.shares.size(), "a vertex and a triangle have so many nodes at most");
  row.shares[row.share_count++] = {node, weight};
}

void ContactSolver::add_side(Row& row, const ContactSide& side, double sign, const BodyContact& contact) {
  if (side.body == kImmovable) return;
  const ContactBody& owner = bodies_[side.body];
  if (owner.rigid) {
    (sign > 0 ? row.one : row.other) = side.body;
    return;
  }
  for (std::size_t a = 0; a < side.v.size(); ++a) {
    const double weight = sign * side.weights[static_cast<int>(a)];
    if (side.v[a] == kNone || weight == 0) continue;
    carriers_.assign(1, {side.v[a], 1});
    if (owner.deformation) owner.deformation->nodes_of(side.v[a], carriers_);
    for (const NodeShare& carrier : carriers_) {
      const std::uint32_t node = borrow(side.body, carrier.node);
      add_share(row, node, weight * carrier.weight);
      row.depth_m += step_s_ * weight * carrier.weight * nodes_[node].velocity_m_per_s.dot(contact.normal_world);
    }
  }
}

// A contact may lie on fixed tissue but for the last digits of its weights. A node with such a weight would have to fly
// off to move it, and doesn't take part.
void ContactSolver::drop_far_levers(Row& row, const BodyContact& c) const {
  const double mass_kg = mass_along(row, c.point_world_m, c.normal_world);
  for (Share& s : std::span(row.shares).first(row.share_count))
    if (std::abs(s.weight) * nodes_[s.node].inverse_mass_per_kg * mass_kg > kLongestLever) s.weight = 0;
}

// The lips of a cut that ends within a cell may hang on the same nodes with nearly the same weights. Nothing but wild
// motion of these nodes would part them.
void ContactSolver::drop_if_together(Row& row) {
  if (row.one != kImmovable || row.other != kImmovable) return;
  double sum = 0;
  for (const Share& s : row.nodes()) sum += std::abs(s.weight);
  if (sum < kTogether) row.share_count = 0;
}

// The effective mass 1 / (J M^-1 J^T) along a direction; 0 if nothing can move.
double ContactSolver::mass_along(const Row& row, const Vec3& point_world_m, const Vec3& along) const {
  double inverse = 0;
  for (const std::uint32_t b : {row.one, row.other}) {
    if (b == kImmovable) continue;
    const RigidBody& body = *bodies_[b].rigid;
    const Vec3 arm = (point_world_m - body.pose_world().position_m).cross(along);
    inverse += 1 / body.mass_kg() + arm.dot(body.inverse_inertia_world() * arm);
  }
  for (const auto& [p, weight] : row.nodes()) inverse += weight * weight * nodes_[p].inverse_mass_per_kg;
  return inverse > 0 ? 1 / inverse : 0;
}

Vec3 ContactSolver::velocity_apart(const Row& row, const BodyContact& c) const {
  Vec3 apart = -c.surface_velocity_m_per_s;
  if (row.one != kImmovable) apart += bodies_[row.one].rigid->velocity_at(c.point_world_m);
  if (row.other != kImmovable) apart -= bodies_[row.other].rigid->velocity_at(c.point_world_m);
  for (const auto& [p, weight] : row.nodes()) apart += weight * nodes_[p].velocity_m_per_s;
  return apart;
}

void ContactSolver::push(Row& row, const BodyContact& c, const Vec3& impulse_n_s) {
  if (row.one != kImmovable) bodies_[row.one].rigid->add_impulse(impulse_n_s, c.point_world_m);
  if (row.other != kImmovable) bodies_[row.other].rigid->add_impulse(-impulse_n_s, c.point_world_m);
  for (const auto& [p, weight] : row.nodes())
    nodes_[p].velocity_m_per_s += weight * nodes_[p].inverse_mass_per_kg * impulse_n_s;
  row.impulse_n_s += impulse_n_s;
}

void ContactSolver::solve_grip(Row& row, const BodyContact& c) {
  for (const auto& [along, mass] :
       {std::pair(c.normal_world, row.mass_n), std::pair(row.u, row.mass_u), std::pair(row.w, row.mass_w)}) {
    const double missing = velocity_apart(row, c).dot(along) + c.grip_softness_per_kg * row.impulse_n_s.dot(along);
    push(row, c, -mass / (1 + mass * c.grip_softness_per_kg) * missing * along);
  }
  const double largest_n_s = c.grip_n * step_s_;
  if (const double size = row.impulse_n_s.norm(); size > largest_n_s)
    push(row, c, (largest_n_s / size - 1) * row.impulse_n_s);
}

void ContactSolver::solve_contact(Row& row, const BodyContact& c) {
  const double missing = row.target_m_per_s - velocity_apart(row, c).dot(c.normal_world);
  const double n = std::max(0.0, row.normal_impulse_n_s + row.mass_n * missing);
  if (n != row.normal_impulse_n_s) push(row, c, (n - row.normal_impulse_n_s) * c.normal_world);
  row.normal_impulse_n_s = n;
  if (n == 0 && row.friction_impulse_n_s.isZero(0)) return;
  const Vec3 slip = velocity_apart(row, c);
  Eigen::Vector2d t =
      row.friction_impulse_n_s - Eigen::Vector2d(row.mass_u * row.u.dot(slip), row.mass_w * row.w.dot(slip));
  const double limit = c.friction * n;  // the friction cone
  if (const double size = t.norm(); size > limit) t *= limit / size;
  const Eigen::Vector2d dt = t - row.friction_impulse_n_s;
  if (!dt.isZero(0)) push(row, c, dt[0] * row.u + dt[1] * row.w);
  row.friction_impulse_n_s = t;
}

void ContactSolver::solve(int sweeps) {
  for (int sweep = 0; sweep < sweeps; ++sweep)
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      const std::size_t i = sweep % 2 == 0 ? k : rows_.size() - 1 - k;
      contacts_[i].grip_n > 0 ? solve_grip(rows_[i], contacts_[i]) : solve_contact(rows_[i], contacts_[i]);
    }
}

// Velocities that serve only to undo depths.
class ContactSolver::Drifts {
 public:
  explicit Drifts(const ContactSolver& solver)
      : solver_(solver), bodies_(solver.bodies_.size()), nodes_(solver.nodes_.size(), Vec3::Zero()) {}

  Vec3 velocity_apart(const Row& row, const Vec3& point_world_m) const {
    Vec3 apart = Vec3::Zero();
    if (row.one != kImmovable) apart += velocity_at(row.one, point_world_m);
    if (row.other != kImmovable) apart -= velocity_at(row.other, point_world_m);
    for (const auto& [p, weight] : row.nodes()) apart += weight * nodes_[p];
    return apart;
  }
  void push(const Row& row, const Vec3& point_world_m, const Vec3& impulse_n_s) {
    if (row.one != kImmovable) push(row.one, impulse_n_s, point_world_m);
    if (row.other != kImmovable) push(row.other, -impulse_n_s, point_world_m);
    for (const auto& [p, weight] : row.nodes())
      nodes_[p] += weight * solver_.nodes_[p].inverse_mass_per_kg * impulse_n_s;
  }
  void shift(std::vector<Node>& nodes) const {
    for (std::size_t b = 0; b < bodies_.size(); ++b)
      if (RigidBody* rigid = solver_.bodies_[b].rigid; rigid && !rigid->asleep())
        rigid->shift(solver_.step_s_ * bodies_[b].velocity, solver_.step_s_ * bodies_[b].spin);
    for (std::size_t p = 0; p < nodes_.size(); ++p) nodes[p].shift_m += solver_.step_s_ * nodes_[p];
  }

 private:
  struct Drift {
    Vec3 velocity = Vec3::Zero(), spin = Vec3::Zero();
  };
  Vec3 velocity_at(std::uint32_t b, const Vec3& point_world_m) const {
    const Vec3 arm = point_world_m - solver_.bodies_[b].rigid->pose_world().position_m;
    return bodies_[b].velocity + bodies_[b].spin.cross(arm);
  }
  void push(std::uint32_t b, const Vec3& impulse_n_s, const Vec3& point_world_m) {
    const RigidBody& body = *solver_.bodies_[b].rigid;
    bodies_[b].velocity += impulse_n_s / body.mass_kg();
    bodies_[b].spin += body.inverse_inertia_world() * (point_world_m - body.pose_world().position_m).cross(impulse_n_s);
  }

  const ContactSolver& solver_;
  std::vector<Drift> bodies_;
  std::vector<Vec3> nodes_;
};

void ContactSolver::undo_depths(int sweeps) {
  std::vector<std::size_t> deep;
  for (std::size_t i = 0; i < rows_.size(); ++i)
    if (rows_[i].depth_m > kSlop_m) deep.push_back(i);
  Drifts drifts(*this);
  std::vector<double> impulses(rows_.size(), 0);
  for (int sweep = 0; sweep < sweeps; ++sweep)
    for (const std::size_t i : deep) {
      const BodyContact& c = contacts_[i];
      const Row& row = rows_[i];
      const double wanted = std::min(c.largest_speed_m_per_s, kDepthUndone * (row.depth_m - kSlop_m) / step_s_);
      const double missing = wanted - drifts.velocity_apart(row, c.point_world_m).dot(c.normal_world);
      const double impulse = std::max(0.0, impulses[i] + row.mass_n * missing);
      drifts.push(row, c.point_world_m, (impulse - impulses[i]) * c.normal_world);
      impulses[i] = impulse;
    }
  drifts.shift(nodes_);
}

std::vector<VertexImpulse> ContactSolver::impulses_on_vertices(std::size_t contact) const {
  std::vector<VertexImpulse> impulses;
  const BodyContact& c = contacts_[contact];
  for (const auto& [side, sign] : {std::pair(&c.one, 1.0), std::pair(&c.other, -1.0)}) {
    if (side->body == kImmovable || bodies_[side->body].rigid) continue;
    for (std::size_t a = 0; a < side->v.size(); ++a)
      if (const double weight = side->weights[static_cast<int>(a)]; side->v[a] != kNone && weight != 0)
        impulses.push_back({side->body, side->v[a], sign * weight * rows_[contact].impulse_n_s});
  }
  return impulses;
}

std::vector<NodeChange> ContactSolver::changes_of(std::uint32_t body) const {
  std::vector<NodeChange> changes;
  for (const Node& n : nodes_) {
    const Vec3 gained = n.velocity_m_per_s - n.velocity_before_m_per_s;
    if (n.body == body && (!gained.isZero(0) || !n.shift_m.isZero(0)))
      changes.push_back({n.number, gained, step_s_ * gained + n.shift_m});
  }
  return changes;
}

}  // namespace sectio

#include "sim_server/body_contact/contact_solver.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace sectio {
namespace {

constexpr double kSlopM = 5e-5;       // depth that is left, so that contacts last
constexpr double kDepthUndone = 0.2;  // share of the remaining depth that one step undoes

// A row of the solver: its velocity is v = v_body - v_other + sum_a share_a v_a at the point of the contact.
struct Row {
  RigidBody* body = nullptr;
  RigidBody* other = nullptr;
  Vec3 u, w;  // tangential directions
  double mass_n = 0, mass_u = 0, mass_w = 0;
  double largest_n_s = 0;     // largest impulse of a grip
  double target_m_per_s = 0;  // least velocity apart
  double n = 0;
  Eigen::Vector2d t = Eigen::Vector2d::Zero();
  Vec3 total = Vec3::Zero();
};

// The effective mass 1 / (J M^-1 J^T) along a direction; 0 if nothing can move.
double mass_along(const ContactSides& sides, const RigidContact& c, const Vec3& along) {
  double inverse = 0;
  for (const std::uint32_t b : {c.body, c.other}) {
    if (b == kImmovable) continue;
    const RigidBody& body = *sides.bodies[b];
    const Vec3 arm = (c.point_world_m - body.pose_world().position_m).cross(along);
    inverse += 1 / body.mass_kg() + arm.dot(body.inverse_inertia_world() * arm);
  }
  for (std::size_t a = 0; a < c.particles.size(); ++a)
    if (c.shares[a] != 0) inverse += c.shares[a] * c.shares[a] * sides.particles[c.particles[a]].inverse_mass_per_kg;
  return inverse > 0 ? 1 / inverse : 0;
}

void shove(Row& row, const ContactSides& sides, const RigidContact& c, const Vec3& impulse) {
  if (row.body) row.body->add_impulse(impulse, c.point_world_m);
  if (row.other) row.other->add_impulse(-impulse, c.point_world_m);
  for (std::size_t a = 0; a < c.particles.size(); ++a) {
    if (c.shares[a] == 0) continue;
    SoftParticle& p = sides.particles[c.particles[a]];
    p.velocity_m_per_s += c.shares[a] * p.inverse_mass_per_kg * impulse;
  }
  row.total += impulse;
}

Vec3 velocity_apart(const Row& row, const ContactSides& sides, const RigidContact& c) {
  Vec3 apart = -c.surface_velocity_m_per_s;
  if (row.body) apart += row.body->velocity_at(c.point_world_m);
  if (row.other) apart -= row.other->velocity_at(c.point_world_m);
  for (std::size_t a = 0; a < c.particles.size(); ++a)
    if (c.shares[a] != 0) apart += c.shares[a] * sides.particles[c.particles[a]].velocity_m_per_s;
  return apart;
}

void solve_grip(Row& row, const ContactSides& sides, const RigidContact& c) {
  for (const auto& [along, mass] :
       {std::pair(c.normal_world, row.mass_n), std::pair(row.u, row.mass_u), std::pair(row.w, row.mass_w)})
    shove(row, sides, c, -mass * velocity_apart(row, sides, c).dot(along) * along);
  if (const double size = row.total.norm(); size > row.largest_n_s)
    shove(row, sides, c, (row.largest_n_s / size - 1) * row.total);
}

void solve(Row& row, const ContactSides& sides, const RigidContact& c) {
  if (c.grip_n > 0) return solve_grip(row, sides, c);
  const double missing = row.target_m_per_s - velocity_apart(row, sides, c).dot(c.normal_world);
  const double n = std::max(0.0, row.n + row.mass_n * missing);
  if (n != row.n) shove(row, sides, c, (n - row.n) * c.normal_world);
  row.n = n;
  if (n == 0 && row.t.isZero(0)) return;
  const Vec3 slip = velocity_apart(row, sides, c);
  Eigen::Vector2d t = row.t - Eigen::Vector2d(row.mass_u * row.u.dot(slip), row.mass_w * row.w.dot(slip));
  const double limit = c.friction * row.n;
  if (const double size = t.norm(); size > limit) t *= limit / size;
  const Eigen::Vector2d dt = t - row.t;
  if (!dt.isZero(0)) shove(row, sides, c, dt[0] * row.u + dt[1] * row.w);
  row.t = t;
}

}  // namespace

void solve_contacts(const ContactSides& sides, std::span<const RigidContact> contacts, const ContactSettings& settings,
                    std::span<Vec3> impulses_on_other_n_s) {
  std::vector<Row> rows(contacts.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const RigidContact& c = contacts[i];
    Row& row = rows[i];
    if (c.body != kImmovable) row.body = sides.bodies[c.body];
    if (c.other != kImmovable) row.other = sides.bodies[c.other];
    row.u = c.normal_world.unitOrthogonal();
    row.w = c.normal_world.cross(row.u);
    row.mass_n = mass_along(sides, c, c.normal_world);
    row.mass_u = mass_along(sides, c, row.u);
    row.mass_w = mass_along(sides, c, row.w);
    row.largest_n_s = c.grip_n * settings.step_s;
    row.target_m_per_s = std::min(0.0, c.depth_m) / settings.step_s;  // a gap may close
  }
  for (int sweep = 0; sweep < settings.sweeps; ++sweep)
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const std::size_t i = sweep % 2 == 0 ? k : rows.size() - 1 - k;
      solve(rows[i], sides, contacts[i]);
    }
  for (std::size_t i = 0; i < impulses_on_other_n_s.size() && i < rows.size(); ++i)
    impulses_on_other_n_s[i] = -rows[i].total;
}

namespace {

// Velocities that serve only to undo depths.
struct Drift {
  Vec3 velocity = Vec3::Zero(), spin = Vec3::Zero();
};

class Drifts {
 public:
  explicit Drifts(const ContactSides& sides)
      : sides_(sides), bodies_(sides.bodies.size()), by_(sides.particles.size()) {
    std::ranges::fill(by_, Vec3::Zero());
  }

  Vec3 apart(const RigidContact& c) const {
    Vec3 sum = Vec3::Zero();
    if (c.body != kImmovable) sum += at(c.body, c.point_world_m);
    if (c.other != kImmovable) sum -= at(c.other, c.point_world_m);
    for (std::size_t a = 0; a < c.particles.size(); ++a)
      if (c.shares[a] != 0) sum += c.shares[a] * by_[c.particles[a]];
    return sum;
  }
  void shove(const RigidContact& c, const Vec3& impulse) {
    if (c.body != kImmovable) shove(c.body, impulse, c.point_world_m);
    if (c.other != kImmovable) shove(c.other, -impulse, c.point_world_m);
    for (std::size_t a = 0; a < c.particles.size(); ++a)
      if (c.shares[a] != 0)
        by_[c.particles[a]] += c.shares[a] * sides_.particles[c.particles[a]].inverse_mass_per_kg * impulse;
  }
  void move(double step_s) const {
    for (std::size_t b = 0; b < bodies_.size(); ++b)
      if (sides_.bodies[b] && !sides_.bodies[b]->asleep())
        sides_.bodies[b]->shift(step_s * bodies_[b].velocity, step_s * bodies_[b].spin);
    for (std::size_t p = 0; p < by_.size(); ++p) sides_.particles[p].shift_m += step_s * by_[p];
  }

 private:
  Vec3 at(std::uint32_t b, const Vec3& point) const {
    return bodies_[b].velocity + bodies_[b].spin.cross(point - sides_.bodies[b]->pose_world().position_m);
  }
  void shove(std::uint32_t b, const Vec3& impulse, const Vec3& point) {
    const RigidBody& body = *sides_.bodies[b];
    bodies_[b].velocity += impulse / body.mass_kg();
    bodies_[b].spin += body.inverse_inertia_world() * (point - body.pose_world().position_m).cross(impulse);
  }

  const ContactSides& sides_;
  std::vector<Drift> bodies_;
  std::vector<Vec3> by_;  // displacements of the particles
};

}  // namespace

void undo_depths(const ContactSides& sides, std::span<const RigidContact> contacts, const ContactSettings& settings) {
  std::vector<std::size_t> deep;
  for (std::size_t i = 0; i < contacts.size(); ++i)
    if (contacts[i].depth_m > kSlopM) deep.push_back(i);
  Drifts drifts(sides);
  std::vector<double> impulses(contacts.size(), 0);
  for (int sweep = 0; sweep < settings.sweeps; ++sweep)
    for (const std::size_t i : deep) {
      const RigidContact& c = contacts[i];
      const double wanted = std::min(c.largest_speed_m_per_s, kDepthUndone * (c.depth_m - kSlopM) / settings.step_s);
      const double missing = wanted - drifts.apart(c).dot(c.normal_world);
      const double impulse = std::max(0.0, impulses[i] + mass_along(sides, c, c.normal_world) * missing);
      drifts.shove(c, (impulse - impulses[i]) * c.normal_world);
      impulses[i] = impulse;
    }
  drifts.move(settings.step_s);
}

}  // namespace sectio

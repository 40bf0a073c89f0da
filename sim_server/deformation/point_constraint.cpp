#include "sim_server/deformation/point_constraint.h"

#include <algorithm>

#include "common/core/error.h"

namespace sectio {
namespace {

constexpr int kSweeps = 8;
// An instrument drives a sample ahead of itself as fast as it goes, and a little faster: a jump takes some steps.
constexpr double kFaster_m_per_s = 0.1;
// No constraint drives a point faster in a step: those that lie further off their target are left alone in it.
constexpr double kDrivenBy_m_per_s = 2 * kFastestHand_m_per_s;
constexpr double kConverged = 1e-2;  // samples that rub: a sweep that changes no impulse by this share is the last

// The impulse (N s) still missing at the constrained point; `so_far` is the sum over earlier sweeps.
Vec3 missing_impulse(const PointConstraint& c, const Vec3& point, double point_mass, double step_s,
                     const Vec3& so_far) {
  const Vec3 needed = point_mass / step_s * (c.target_world_m - point);
  if (!c.unilateral) {
    const Vec3 total = so_far + needed;
    const double most = step_s * c.largest_force_n, size = total.norm();
    return size <= most ? needed : Vec3(most / size * total - so_far);
  }
  // The sum of impulses may push along the inward normal but not pull.
  const double given = -so_far.dot(c.normal);
  const double total = std::max(0.0, given - needed.dot(c.normal));
  if (c.sticks) return total > 0 ? needed : Vec3(-so_far);
  return -(total - given) * c.normal;
}

double depth_of(const PointConstraint& c, const Vec3& point) {
  return (point - c.target_world_m).dot(c.normal);
}

// The depths of a sample at the beginning of a step, and once the tissue has moved by itself.
struct DepthsBefore {
  double begun_m = 0, free_m = 0;
};

// The same for a sample with a spring in series, or with friction. The sum of impulses may push along the inward normal
// but not pull. Over h, an impulse J moves the point by h J / m, and the spring gives way by a J / h, as far as it can:
// beyond, the point is driven ahead, at a bounded speed whoever drives it: samples share vertices. Ahead of a tip, the
// way by which the tissue comes back in a step doesn't count, or a light point could not be held against its springs.
// Friction is what stops the point against the instrument, but no more than its coefficient times the push.
Vec3 missing_of_sample(const PointConstraint& c, const Vec3& point, const DepthsBefore& before, const Vec3& velocity,
                       double point_mass, double step_s, const Vec3& so_far) {
  const double given = -so_far.dot(c.normal), a = c.compliance_m_per_n / step_s, moves = step_s / point_mass;
  const double depth = depth_of(c, point);
  const double speed_m_per_s = std::min(kFastestHand_m_per_s, c.target_velocity_m_per_s.norm() + kFaster_m_per_s);
  const double came_back_m = c.is_ahead ? std::max(0.0, before.free_m - before.begun_m) : 0;
  const double may_move_m = speed_m_per_s * step_s - std::max(moves * given - came_back_m, before.begun_m - depth);
  const double driven = std::min(depth - c.gives_most_m, std::max(0.0, may_move_m));
  const double total = std::max({0.0, given + (depth - a * given) / (moves + a), given + driven / moves});
  Vec3 along = so_far + given * c.normal;
  if (c.springs_along) {
    const Vec3 off_m = point - c.target_world_m;
    along -= (off_m - off_m.dot(c.normal) * c.normal + a * along) / (moves + a);
  } else {
    const Vec3 slip = velocity - c.target_velocity_m_per_s;
    along -= point_mass * (slip - slip.dot(c.normal) * c.normal);
  }
  const double size = along.norm(), most = c.friction * total;
  if (size > most) along *= most / size;
  return along - total * c.normal - so_far;
}

bool is_sample(const PointConstraint& c) {
  return c.friction > 0 || c.compliance_m_per_n > 0;
}

}  // namespace

Reaction reaction_of_wall(const PointConstraint& c, const Vec3& point) {
  if (!c.unilateral || c.sticks) return {};
  const double depth_m = std::max(0.0, depth_of(c, point));
  const double spring_m = c.compliance_m_per_n > 0 ? std::min(depth_m, c.gives_most_m) : 0;
  const double spring_n = spring_m > 0 ? spring_m / c.compliance_m_per_n : 0;
  return {(spring_n + kWall_n_per_m * (depth_m - spring_m)) * c.normal, depth_m > 0, 0};
}

void ConstraintSupports::add(std::uint32_t particle, double weight) {
  for (std::size_t i = first_.back(); i < shares_.size(); ++i)
    if (shares_[i].particle == particle) {
      shares_[i].weight += weight;
      return;
    }
  shares_.push_back({particle, weight});
}

void corners_of(std::span<const PointConstraint> constraints, ConstraintSupports& supports) {
  supports.clear();
  for (const PointConstraint& c : constraints) {
    for (std::size_t a = 0; a < 3; ++a)
      if (c.v[a] != kNone) supports.add(c.v[a], c.w[a]);
    supports.finish();
  }
}

void project(std::span<const PointConstraint> constraints, const ConstraintSupports& supports,
             std::span<const double> inverse_mass, double step_s, std::span<Vec4f> position_world_m,
             std::span<Vec4f> velocity_m_per_s, std::span<Reaction> reactions) {
  SECTIO_ASSERT(reactions.size() == constraints.size(), "one reaction a constraint");
  std::fill(reactions.begin(), reactions.end(), Reaction{});
  thread_local std::vector<double> inverse_of;
  thread_local std::vector<DepthsBefore> before;
  thread_local std::vector<std::uint32_t> near;
  inverse_of.assign(constraints.size(), 0);
  before.assign(constraints.size(), {});
  near.clear();
  bool samples = false;
  for (std::uint32_t n = 0; n < constraints.size(); ++n) {
    const PointConstraint& c = constraints[n];
    const auto by = supports.of(n);
    const Vec3 free = carried(by, position_world_m);
    if (is_sample(c)) samples = true;
    if (c.unilateral && depth_of(c, free) < -kDrivenBy_m_per_s * step_s) continue;
    for (const auto& [particle, weight] : by) inverse_of[n] += weight * weight * inverse_mass[particle];
    if (is_sample(c)) before[n] = {depth_of(c, free - step_s * carried(by, velocity_m_per_s)), depth_of(c, free)};
    if (inverse_of[n] > 0)
      near.push_back(n);
    else
      reactions[n] = reaction_of_wall(c, free);
  }
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    double largest = 0, largest_change = 0;
    for (const std::uint32_t n : near) {
      const auto by = supports.of(n);
      const double inverse = inverse_of[n];
      const Vec3 so_far = -step_s * reactions[n].force_on_tool_n;
      const PointConstraint& c = constraints[n];
      const Vec3 point = carried(by, position_world_m);
      if (is_sample(c) && so_far.isZero(0) && depth_of(c, point) <= 0) continue;
      const Vec3 impulse = is_sample(c) ? missing_of_sample(c, point, before[n], carried(by, velocity_m_per_s),
                                                            1 / inverse, step_s, so_far)
                                        : missing_impulse(c, point, 1 / inverse, step_s, so_far);
      if (impulse.isZero(0)) continue;
      for (const auto& [particle, weight] : by) {
        const Vec3 dv = weight * inverse_mass[particle] * impulse;
        position_world_m[particle].head<3>() += (step_s * dv).cast<float>();
        velocity_m_per_s[particle].head<3>() += dv.cast<float>();
      }
      reactions[n].force_on_tool_n -= impulse / step_s;
      reactions[n].active = true;
      largest = std::max(largest, reactions[n].force_on_tool_n.squaredNorm());
      largest_change = std::max(largest_change, impulse.squaredNorm() / (step_s * step_s));
    }
    if (largest_change == 0 || (samples && largest_change <= kConverged * kConverged * largest)) break;
  }
  for (const std::uint32_t n : near)
    if (reactions[n].active)
      reactions[n].work_j = -step_s * reactions[n].force_on_tool_n.dot(carried(supports.of(n), velocity_m_per_s));
}

void project(std::span<const PointConstraint> constraints, std::span<const double> inverse_mass, double step_s,
             std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s, std::span<Reaction> reactions) {
  thread_local ConstraintSupports supports;
  corners_of(constraints, supports);
  project(constraints, supports, inverse_mass, step_s, position_world_m, velocity_m_per_s, reactions);
}

}  // namespace sectio

#include "sim_server/deformation/point_constraint.h"

#include <algorithm>

#include "common/core/error.h"

namespace sectio {
namespace {

constexpr int kSweeps = 8;  // enough for the few constraints of a step, which share at most a triangle

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

Vec3 carried(std::span<const ConstraintSupports::Share> by, std::span<const Vec4f> what) {
  Vec3 sum = Vec3::Zero();
  for (const auto& [particle, weight] : by) sum += weight * what[particle].head<3>().cast<double>();
  return sum;
}

}  // namespace

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
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (std::size_t n = 0; n < constraints.size(); ++n) {
      const auto by = supports.of(n);
      double inverse = 0;
      for (const auto& [particle, weight] : by) inverse += weight * weight * inverse_mass[particle];
      if (!(inverse > 0)) continue;
      const Vec3 so_far = -step_s * reactions[n].force_on_tool_n;
      const Vec3 impulse = missing_impulse(constraints[n], carried(by, position_world_m), 1 / inverse, step_s, so_far);
      if (impulse.isZero(0)) continue;
      for (const auto& [particle, weight] : by) {
        const Vec3 dv = weight * inverse_mass[particle] * impulse;
        position_world_m[particle].head<3>() += (step_s * dv).cast<float>();
        velocity_m_per_s[particle].head<3>() += dv.cast<float>();
      }
      reactions[n].force_on_tool_n -= impulse / step_s;
      reactions[n].active = true;
    }
  }
  for (std::size_t n = 0; n < constraints.size(); ++n) {
    reactions[n].work_j = -step_s * reactions[n].force_on_tool_n.dot(carried(supports.of(n), velocity_m_per_s));
    if (!constraints[n].stops || !reactions[n].active) continue;
    for (const auto& [particle, weight] : supports.of(n)) velocity_m_per_s[particle].setZero();
  }
}

void project(std::span<const PointConstraint> constraints, std::span<const double> inverse_mass, double step_s,
             std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s, std::span<Reaction> reactions) {
  thread_local ConstraintSupports supports;
  corners_of(constraints, supports);
  project(constraints, supports, inverse_mass, step_s, position_world_m, velocity_m_per_s, reactions);
}

}  // namespace sectio

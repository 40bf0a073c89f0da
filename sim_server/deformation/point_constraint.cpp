#include "sim_server/deformation/point_constraint.h"

#include <algorithm>

#include "common/core/error.h"

namespace sectio {
namespace {

constexpr int kSweeps = 8;  // a handful of constraints that share at most a triangle

// The impulse (N s) still missing at the constrained point; `so_far` is what earlier sweeps gave.
Vec3 missing_impulse(const PointConstraint& c, const Vec3& point, double point_mass, double step_s,
                     const Vec3& so_far) {
  const Vec3 needed = point_mass / step_s * (c.target_world_m - point);
  if (!c.unilateral) {
    const Vec3 total = so_far + needed;
    const double most = step_s * c.largest_force_n, size = total.norm();
    return size <= most ? needed : Vec3(most / size * total - so_far);
  }
  // Along the inward normal the sum of impulses may push but not pull.
  const double given = -so_far.dot(c.normal);
  const double total = std::max(0.0, given - needed.dot(c.normal));
  if (c.sticks) return total > 0 ? needed : Vec3(-so_far);
  return -(total - given) * c.normal;
}

}  // namespace

void project(std::span<const PointConstraint> constraints, std::span<const double> inverse_mass, double step_s,
             std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s, std::span<Reaction> reactions) {
  SECTIO_ASSERT(reactions.size() == constraints.size(), "one reaction a constraint");
  std::fill(reactions.begin(), reactions.end(), Reaction{});
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (std::size_t n = 0; n < constraints.size(); ++n) {
      const PointConstraint& c = constraints[n];
      Vec3 point = Vec3::Zero();
      double inverse = 0;
      for (std::size_t a = 0; a < 3; ++a) {
        if (c.v[a] == kNone) continue;
        point += c.w[a] * position_world_m[c.v[a]].head<3>().cast<double>();
        inverse += c.w[a] * c.w[a] * inverse_mass[c.v[a]];
      }
      if (!(inverse > 0)) continue;
      const Vec3 so_far = -step_s * reactions[n].force_on_tool_n;
      const Vec3 impulse = missing_impulse(c, point, 1 / inverse, step_s, so_far);
      if (impulse.isZero(0)) continue;
      for (std::size_t a = 0; a < 3; ++a) {
        if (c.v[a] == kNone) continue;
        const Vec3 dv = c.w[a] * inverse_mass[c.v[a]] * impulse;
        position_world_m[c.v[a]].head<3>() += (step_s * dv).cast<float>();
        velocity_m_per_s[c.v[a]].head<3>() += dv.cast<float>();
      }
      reactions[n].force_on_tool_n -= impulse / step_s;
      reactions[n].active = true;
    }
  }
  for (std::size_t n = 0; n < constraints.size(); ++n) {
    const PointConstraint& c = constraints[n];
    Vec3 velocity = Vec3::Zero();
    for (std::size_t a = 0; a < 3; ++a)
      if (c.v[a] != kNone) velocity += c.w[a] * velocity_m_per_s[c.v[a]].head<3>().cast<double>();
    reactions[n].work_j = -step_s * reactions[n].force_on_tool_n.dot(velocity);
    for (std::size_t a = 0; c.stops && reactions[n].active && a < 3; ++a)
      if (c.v[a] != kNone) velocity_m_per_s[c.v[a]].setZero();
  }
}

}  // namespace sectio

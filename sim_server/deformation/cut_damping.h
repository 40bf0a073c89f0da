// The viscosity of the springs around cuts.
//
// Damping in proportion to velocity hardly acts on fast modes: a short spring that a cut has stretched rings on for
// hundreds of steps, and its ends pass each other, which no bound on the step foresees. Tissue is viscous. Along each
// spring at a fast vertex, an impulse takes the share f of the relative velocity of its ends:
//
//   f = min(1/2, 2 zeta omega h)    omega^2 = k (1/m_a + 1/m_b)    zeta = 0.1: a loss factor of 0.2, as soft tissue's
//
// Momentum is kept, energy only lost, whatever the step is. O(vertices around cuts) a step; a slow one costs a
// comparison.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "common/math/types.h"
#include "sim_server/deformation/spring_rows.h"

namespace sectio {

class CutDamping {
 public:
  // Acts on the springs of this vertex from now on, or no longer.
  void watch(VertexId v);
  void forget(VertexId v);

  // Call between the update of the velocities and that of the positions over step_s. inverse_mass: one a vertex slot,
  // 0 for fixed ones. Vertices that a constraint may push are left to it. Does not allocate.
  template <class IsHeld>
  void damp(const SpringRows& rows, std::span<const double> inverse_mass, double step_s, const IsHeld& is_held,
            std::span<const Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s) const;

  template <class A>
  void archive(A& a) {
    a(watched_);
  }

 private:
  static constexpr float kDampingRatio = 0.1f, kMostShare = 0.5f;
  static constexpr float kSlow_m_per_s = 0.01f;  // a vertex that rings is faster

  std::vector<VertexId> watched_;  // ascending
};

template <class IsHeld>
void CutDamping::damp(const SpringRows& rows, std::span<const double> inverse_mass, double step_s,
                      const IsHeld& is_held, std::span<const Vec4f> position_world_m,
                      std::span<Vec4f> velocity_m_per_s) const {
  const auto zeta_h = kDampingRatio * static_cast<float>(step_s);
  for (const VertexId v : watched_) {
    if (!(velocity_m_per_s[v].norm() > kSlow_m_per_s) || is_held(v)) continue;
    for (std::uint32_t n = 0; n < rows.degree(v); ++n) {
      const HalfEdge spring = rows.half_edge(v, n);
      const Vec3f d = (position_world_m[spring.to] - position_world_m[v]).head<3>();
      const auto a = static_cast<float>(inverse_mass[v]), b = static_cast<float>(inverse_mass[spring.to]);
      const float divisor = d.squaredNorm() * (a + b);
      if (!(divisor > 0) || is_held(spring.to)) continue;
      const float share = std::min(kMostShare, 2 * zeta_h * std::sqrt(spring.k * (a + b)));
      const float closing = (velocity_m_per_s[spring.to] - velocity_m_per_s[v]).head<3>().dot(d);
      const Vec3f impulse = share * closing / divisor * d;
      velocity_m_per_s[v].head<3>() += a * impulse;
      velocity_m_per_s[spring.to].head<3>() -= b * impulse;
    }
  }
}

}  // namespace sectio

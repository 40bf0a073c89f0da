// The short springs that cuts leave, which a step may press through their own length.
//
// No bound on the step foresees such a spring. Once its ends have passed each other it pulls them back, and they pass
// each other again in the next step, and so on without end:
//
//     a ->  <- b     |d| < h |v_b - v_a|      b <-  -> a     at h = 1 ms and 1 m/s, all springs below 1 mm
//
// Ends that pass each other once or twice do no harm: a blade that goes by presses them. A vertex at which that happens
// again and again is stopped: where ends would pass each other in this step, an impulse along the spring takes their
// relative velocity along it, as in an inelastic collision. Momentum is kept, energy only lost. O(vertices around cuts)
// a step.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "common/math/types.h"
#include "sim_server/deformation/spring_rows.h"

namespace sectio {

class ShortSprings {
 public:
  // Watches these springs of a vertex, or goes on to.
  void watch(VertexId v, std::span<const HalfEdge> springs);
  void forget(VertexId v);

  // Call between the update of the velocities and that of the positions over step_s. inverse_mass: one a vertex slot,
  // 0 for fixed ones. Vertices that a constraint may push are left to it. Does not allocate.
  template <class IsHeld>
  void stop_crossings(const SpringRows& rows, std::span<const double> inverse_mass, double step_s,
                      const IsHeld& is_held, std::span<const Vec4f> position_world_m,
                      std::span<Vec4f> velocity_m_per_s);

  template <class A>
  void archive(A& a) {
    a(watched_);
  }

 private:
  static constexpr int kRise = 2, kFall = 1, kTooOften = 40, kMost = 60;  // Watched::passed counts with these
  struct Watched {
    VertexId v = kNone;
    float shortest_m = 0;
    std::uint8_t passed = 0;  // rises with steps in which ends pass each other, falls with others

    template <class A>
    void archive(A& a) {
      a(v, shortest_m, passed);
    }
  };
  std::vector<Watched> watched_;  // in order of v
};

template <class IsHeld>
void ShortSprings::stop_crossings(const SpringRows& rows, std::span<const double> inverse_mass, double step_s,
                                  const IsHeld& is_held, std::span<const Vec4f> position_world_m,
                                  std::span<Vec4f> velocity_m_per_s) {
  const auto h = static_cast<float>(step_s);
  for (Watched& w : watched_) {
    // Two slower vertices don't reach each other.
    const bool may_pass = 2 * h * velocity_m_per_s[w.v].norm() > w.shortest_m;
    bool passes = false;
    for (std::uint32_t n = 0; may_pass && n < rows.degree(w.v); ++n) {
      const VertexId to = rows.half_edge(w.v, n).to;
      const Vec3f d = (position_world_m[to] - position_world_m[w.v]).head<3>();
      const float closing = (velocity_m_per_s[to] - velocity_m_per_s[w.v]).head<3>().dot(d), squared = d.squaredNorm();
      if (!(squared + h * closing < 0)) continue;
      passes = true;
      const auto a = static_cast<float>(inverse_mass[w.v]), b = static_cast<float>(inverse_mass[to]);
      if (w.passed < kTooOften || !(squared * (a + b) > 0) || is_held(w.v) || is_held(to)) continue;
      const Vec3f impulse = closing / (squared * (a + b)) * d;
      velocity_m_per_s[w.v].head<3>() += a * impulse;
      velocity_m_per_s[to].head<3>() -= b * impulse;
    }
    w.passed = static_cast<std::uint8_t>(std::clamp(w.passed + (passes ? kRise : -kFall), 0, kMost));
  }
}

}  // namespace sectio

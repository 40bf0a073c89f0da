// The inner loops of the surface springs: one symplectic Euler step over rows in SELL-16. A neighbour costs one aligned
// 16-byte load and a share of a transpose in registers (hardware gathers are three times slower on Zen 4).
//
//   v_i <- (1 - alpha h) v_i + h/m_i [ sum_j (k_ij - k_ij l0_ij / l_ij)(x_j - x_i) + k_h,i (home_i - x_i) ] + h g s_i
//   x_i <- x_i + h v_i
//
// Square root and division are those of IEEE 754, and fused multiply-adds are explicit: every machine computes the same
// bits, with registers of 8 lanes (AVX2) and of 16 (AVX-512, chosen at run time). No allocation.
#pragma once

#include <span>

#include "sim_server/deformation/simd_width.h"
#include "sim_server/deformation/spring_rows.h"

namespace sectio {

// The largest speed of a particle: above that of any surgical motion, and about an edge a step at 1 ms.
constexpr double kMaxSpeed_m_per_s = 5;

struct VelocityUpdate {
  float damping_factor = 1;            // 1 - alpha h
  Vec3f gravity_step = Vec3f::Zero();  // h g, m/s
  float max_speed_m_per_s = 0;
  // Each spring has a damper along it, + damper_s k (d . dv) / l^2 d; 0: none. With dampers, velocity_before must be a
  // copy of all velocities before the update.
  float damper_s = 0;
  std::span<const Vec4f> velocity_before = {};
};

struct VelocityOutcome {
  std::uint32_t clamped = 0;    // vertices whose speed was reduced to the cap
  VertexId not_finite = kNone;  // the first vertex whose velocity was not finite; such velocities are set to zero
};

// Positions and velocities are {x, y, z, 0}, one for every vertex slot that a row names.
VelocityOutcome update_velocities(const SpringRows& rows, const VelocityUpdate& update,
                                  std::span<const Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
                                  SimdWidth width = SimdWidth::widest);

void update_positions(float step_s, std::span<const Vec4f> velocity_m_per_s, std::span<Vec4f> position_world_m);

}  // namespace sectio

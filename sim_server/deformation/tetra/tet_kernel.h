// The inner loops of the neo-Hookean solid, over rows in SELL-16 (tet_rows.h). With J_i the mean of the volume ratios
// around vertex i, weighted by rest volume, and p_i = kappa_i (J_i - 1) its pressure:
//
//   E  = sum_e V_e [ mu_e / 2 (|F_e|^2 - 3) - mu_e (J_e - 1) ] + sum_i V_i kappa_i / 2 (J_i - 1)^2
//   f_i = sum_j w_ij (x_j - x_i) + sum_e (mu_e - mean of p over e's corners) n_e / 6
//
// the stable neo-Hookean energy without logarithm (Smith et al. 2018) with averaged nodal pressure (Joldes et al.
// 2009). Positions are {x, y, z, p / 24}. Exact IEEE operations and explicit fused multiply-adds in one order: the same
// bits in registers of 8 lanes as of 16. No allocation.
#pragma once

#include <span>

#include "sim_server/deformation/spring_kernel.h"
#include "sim_server/deformation/tetra/tet_rows.h"

namespace sectio {

// Writes p / 24 into the fourth component. Returns an upper estimate of the largest omega^2, 1/s^2, up to a factor that
// is the same in every state: max_i (2 sum_j |w_ij| + 4 sum_e kappa_e / (36 V_e) |n_e|^2) / m_i; 0 unless asked for.
float update_pressures(const TetRows& rows, bool with_bound, std::span<Vec4f> position_world_m,
                       SpringLanes lanes = SpringLanes::widest);

// v <- (1 - alpha h) v + h f / m + h g s, with pressures as they are.
VelocityOutcome update_velocities(const TetRows& rows, const VelocityUpdate& update,
                                  std::span<const Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
                                  SpringLanes lanes = SpringLanes::widest);

// One sweep of vertex block descent (Chen et al. 2024) on  |x - y|^2_m / (2 h^2) + E(x), colour after colour: each
// vertex goes to the minimum of a quadratic that is above the objective and touches it where the vertex is. For one
// element the objective is such a quadratic, as J is affine in one corner; for the nodal mean it follows from Jensen's
// inequality: no line search, the objective never grows, whatever the step and however inverted the state. Keeps
// pressures current. `scratch`: at least 3 * 16 * rows.most_faces() floats, aligned to 64 bytes. Returns the largest
// |dx|^2, m^2.
float descend(const TetRows& rows, float step_s, std::span<const Vec4f> inertial_world_m,
              std::span<Vec4f> position_world_m, std::span<float> scratch, SpringLanes lanes = SpringLanes::widest);

}  // namespace sectio

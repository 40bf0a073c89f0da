// The inner loops of the neo-Hookean solid, over rows in SELL-16 (tet_rows.h). With J_i the mean of the volume ratios
// around vertex i, weighted by rest volume, and p_i = kappa_i (J_i - 1) its pressure:
//
//   E  = sum_e V_e [ mu_e / 2 (|F_e|^2 - 3) - mu_e (J_e - 1) ] + sum_i V_i kappa_i / 2 (J_i - 1)^2
//   f_i = sum_j w_ij (x_j - x_i) + sum_e (mu_e - mean of p over e's corners) n_e / 6
//
// the stable neo-Hookean energy without logarithm (Smith et al. 2018) with averaged nodal pressure (Joldes et al.
// 2009). Positions are {x, y, z, p / 24}. IEEE operations and explicit fused multiply-adds in a fixed order: registers
// of 8 and of 16 lanes compute the same bits. No allocation.
#pragma once

#include <span>

#include "sim_server/deformation/spring_kernel.h"
#include "sim_server/deformation/tetra/tet_rows.h"

namespace sectio {

// Writes p / 24 into the fourth component. If `with_bound`, returns max_i (2 sum_j |w_ij| + 4 sum_e kappa_e / (36 V_e)
// |n_e|^2) / m_i, which is an upper estimate of the largest omega^2, 1/s^2, up to a factor that no state changes; else
// 0.
float update_pressures(const TetRows& rows, bool with_bound, std::span<Vec4f> position_world_m,
                       SimdWidth width = SimdWidth::widest);

// v <- (1 - alpha h) v + h f / m + h g s, with the present pressures.
VelocityOutcome update_velocities(const TetRows& rows, const VelocityUpdate& update,
                                  std::span<const Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s,
                                  SimdWidth width = SimdWidth::widest);

// One sweep of vertex block descent (Chen et al. 2024) on  |x - y|^2_m / (2 h^2) + E(x), colour after colour: each
// vertex moves to the minimum of a quadratic that lies above the objective and touches it at the vertex's place. For
// one element the objective is such a quadratic, as J is affine in one corner; for the nodal mean it follows from
// Jensen's inequality. So the objective never grows, whatever the step and however inverted the state; no line search.
// Keeps pressures current. `scratch`: at least 3 * 16 * rows.most_faces() floats, aligned to 64 bytes. Returns the
// largest |dx|^2, m^2.
float descend(const TetRows& rows, float step_s, std::span<const Vec4f> inertial_world_m,
              std::span<Vec4f> position_world_m, std::span<float> scratch, SimdWidth width = SimdWidth::widest);

}  // namespace sectio

// The inner loops of the implicit driver's neo-Hookean solid, over the rows of tet_rows.h: forces by exact differences
// of positions, the Hessian by half-edge, and its product. tet_energy.h has the equations. An edge column of a row i
// with neighbour j has, beside l_ij = - w_ij of the row,
//
//   s = sum over tetrahedra at the edge of c_e (edge opposite) / 6:  c_e d2V_e p = s x p
//   g = sqrt(D_i) sum n_j^e,  t = sqrt(D_j) sum n_i^e  (the transpose of g)
//
// The product takes two passes: q_i = g_ii.p_i + sum_j g_ij.p_j, which travels in the fourth component of p, then
// y_i = l_ii p_i + g_ii q_i + sum_j (l_ij p_j + s_ij x p_j + t_ij q_j). Registers of 8 and of 16 lanes compute the same
// bits. No allocation.
#pragma once

#include <span>

#include "sim_server/deformation/simd_width.h"
#include "sim_server/deformation/tetra/tet_rows.h"

namespace sectio {

struct alignas(64) TetHessianColumn {
  std::array<std::array<float, kLanes>, 3> s{}, g{}, t{};
};
struct alignas(64) TetHessianSlice {
  std::array<std::array<float, kLanes>, 3> g{};      // g_ii
  std::array<std::array<float, kLanes>, 6> block{};  // on the diagonal: xx yy zz xy xz yz
};

struct TetHessian {
  std::vector<TetHessianColumn> columns;  // one an edge column
  std::vector<TetHessianSlice> slices;
  std::vector<TetEdgeColumn> scratch;  // aligned memory
  void resize(const TetRows& rows);
};

// Positions are `position` + `low`, what rounding has left of each. Writes the pressures p / 24 into the fourth
// component of `position`.
void update_pressures(const TetRows& rows, std::span<Vec4f> position_world_m, std::span<const Vec4f> low_m,
                      SimdWidth width = SimdWidth::widest);
// The elastic forces, with the present pressures, for all vertices that have a row.
void elastic_forces(const TetRows& rows, std::span<const Vec4f> position_world_m, std::span<const Vec4f> low_m,
                    std::span<Vec4f> force_n, SimdWidth width = SimdWidth::widest);
// The Hessian here, with the present pressures.
void linearise(const TetRows& rows, std::span<const Vec4f> position_world_m, TetHessian& hessian,
               SimdWidth width = SimdWidth::widest);
// Adds K p; writes the fourth components of p.
void add_product(const TetRows& rows, const TetHessian& hessian, std::span<Vec4f> p_m, std::span<Vec4f> force_n,
                 SimdWidth width = SimdWidth::widest);

}  // namespace sectio

// The inner loops of the lattice hexahedra (HexSolid). With s_k(a) = +-1 the signs of corner a along the axes and their
// products, m_k = sum_a s_k(a) x_a the cell's modes, M = [m_x m_y m_z] = 4 h F, B the three modes of two signs over 8
// and C that of three over 8:
//
//   E = sum_e phi V { mu/2 (|F|^2 - 3) - mu (J - 1) + kappa/2 (J - 1)^2
//                     + 4 mu c / h^2 (|B_xy|^2 + |B_yz|^2 + |B_zx|^2 + |C|^2 / 2) }
//
// stable neo-Hookean (Smith et al. 2018, without logarithm) at one point, and springs between modes against hourglass
// deformation, which rigid motion doesn't stretch; phi is the cell's fill, mass phi rho V / 8 at each corner. c is
// chosen for bending. One pass over the cells adds to the forces of the nodes, cell after cell; one over the nodes
// moves them. IEEE operations in a fixed order: registers of 8 and of 16 lanes compute the same bits. No allocation.
#pragma once

#include <span>
#include <vector>

#include "sim_server/deformation/hexa/hex_lattice.h"
#include "sim_server/deformation/spring_kernel.h"

namespace sectio {

constexpr double kHourglass = 0.36;

struct HexMaterial {
  double shear_pa = 0;  // mu
  double bulk_pa = 0;   // kappa = lambda + mu
  double density_kg_per_m3 = 0;
};

// Sixteen cells. Lanes beyond the last cell are copies of lane 0 without stiffness.
struct alignas(64) HexBatch {
  std::array<std::array<std::uint32_t, kLanes>, 8> offset{};  // of the nodes
  std::array<float, kLanes> shear{};                          // phi mu h / 16, N/m
  std::array<float, kLanes> bulk{};                           // phi kappa / 64, Pa
  std::array<float, kLanes> stiffness{};                      // the material's stiffness factor
};

struct HexRows {
  std::vector<HexBatch> batches;
  float cell_m = 0;
  float bulk_over_shear = 0;   // kappa / mu
  float omega2_per_shear = 0;  // 4 mu / (rho h^2), 1/s^2
};
HexRows rows_of(const HexLattice& lattice, const HexMaterial& material);

// Adds the cells' elastic forces to `force_n` ({x y z 0}, one a node). If `with_bound`, returns a bound on the largest
// omega^2, 1/s^2, else 0. As mass and stiffness are both proportional to phi,
//   omega^2 <= max_e 4 / (rho h^2) (mu + kappa |cof F|^2 + |kappa (J - 1) - mu| |F|)
// holds in any state, whatever is cut and however small the fill of a cell.
float add_forces(const HexRows& rows, bool with_bound, std::span<const Vec4f> position_world_m,
                 std::span<Vec4f> force_n, SimdWidth width = SimdWidth::widest);

// v <- (1 - alpha h) v + (h / m) f + h g, x <- x + h v; then sets the forces to 0. A node of inverse mass 0 stays.
// VelocityOutcome::clamped doesn't count nodes lighter than `slight_kg`: a cut may leave next to nothing in a cell.
VelocityOutcome move_nodes(const VelocityUpdate& update, float step_s, float slight_kg,
                           std::span<const float> inverse_mass_per_kg, std::span<Vec4f> force_n,
                           std::span<Vec4f> velocity_m_per_s, std::span<Vec4f> position_world_m);

// The bound at rest, 12 K / (rho h^2) with K = lambda + 2 mu / 3. A single free cell attains it by swelling and
// shrinking.
double omega2_at_rest(const HexMaterial& material, double cell_m, double largest_factor);

}  // namespace sectio

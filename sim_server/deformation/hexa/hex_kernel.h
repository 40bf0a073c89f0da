// The inner loops of the lattice hexahedra (HexSolid). With s_k(a) = +-1 the signs of corner a along the axes and
// their products, n_k = sum_a s_k(a) x_a the cell's modes; d the centroid of its material and I its mean squares
// about it, in coordinates from -1 to 1; M = [M_x M_y M_z] = 4 h F and b the modes about that centroid, which are
// slopes and mixed derivatives of the deformation there; a = phi mu h / 16:
//
//   b_xy = n_xy + d_z n_xyz, ...      M_x = n_x + d_y n_xy + d_z n_zx + d_y d_z n_xyz, ...      (cyclic)
//   E = sum_e phi V { mu/2 (|F|^2 - 3) - mu (J - 1) + kappa/2 (J - 1)^2 }
//     + 3 c a/2 [ (I_x + I_y) |b_xy|^2 + (I_x + I_z) |b_zx|^2 + (I_y + I_z) |b_yz|^2
//                 + (I_x I_y + I_y I_z + I_z I_x) |n_xyz|^2 ]
//     - tau f a / (4 h) [ I_x M_x.(b_xy x b_zx) + I_y M_y.(b_yz x b_xy) + I_z M_z.(b_zx x b_yz) ]
//
// First stable neo-Hookean (Smith et al. 2018, without logarithm) at one point; then springs, which rigid motion
// doesn't stretch: with c = 1/3 they are the integral of mu/2 |F|^2 beyond that point; then the same of - mu (J - 1),
// without which twisting is too stiff. f = 2 / (1 + |F|^2 / 3 + 3 |b|^2 / (48 h^2)) keeps it below the springs. phi
// is the cell's fill, mass phi rho V / 8 at each corner. c is chosen for bending and torsion. One pass over the cells
// adds to the forces of the nodes, cell after cell; one over the nodes moves them. IEEE operations in a fixed order:
// registers of 8 and of 16 lanes compute the same bits. No allocation.
#pragma once

#include <span>
#include <vector>

#include "sim_server/deformation/hexa/hex_lattice.h"
#include "sim_server/deformation/spring_kernel.h"

namespace sectio {

constexpr double kHourglass = 0.30;  // c
constexpr double kTwist = 0.90;      // tau
constexpr double kTangle = 3;

struct HexMaterial {
  double shear_pa = 0;  // mu
  double bulk_pa = 0;   // kappa = lambda + mu
  double density_kg_per_m3 = 0;
};

// Sixteen cells. Lanes beyond the last cell are copies of lane 0 without stiffness.
struct alignas(64) HexBatch {
  std::array<std::array<std::uint32_t, kLanes>, 8> offset{};                // offsets of the nodes
  std::array<float, kLanes> shear{};                                        // phi mu h / 16, N/m
  std::array<float, kLanes> bulk{};                                         // phi kappa / 64, Pa
  std::array<float, kLanes> stiffness{};                                    // s_e, see add_forces()
  std::array<std::array<float, kLanes>, 3> offset_of_material{}, spread{};  // d, I
};

struct HexRows {
  std::vector<HexBatch> batches;
  float cell_m = 0;
  float bulk_over_shear = 0;   // kappa / mu
  float omega2_per_shear = 0;  // 4 mu / (rho h^2), 1/s^2
  double stiffest = 1;         // the largest stiffness factor
};
HexRows rows_of(const HexLattice& lattice, const HexMaterial& material);

// The masses with which nodes move, in rho V: the mass of their material. Nodes of fragments get more, so that s_e
// stays below the largest stiffness factor: no cut makes the stable step shorter.
std::vector<double> effective_masses(const HexLattice& lattice);

// Adds the cells' elastic forces to `force_n` ({x y z 0}, one a node). If `with_bound`, returns a bound on the
// largest omega^2, 1/s^2, else 0. Since mass and stiffness are both proportional to phi,
//   omega^2 <= max_e s_e 4 / (rho h^2) (mu + kappa |cof F|^2 + |kappa (J - 1) - mu| |F|)
// holds in any state, whatever is cut and however small the fill of a cell. s_e is the material's stiffness factor
// where cells are whole. In general, with g_ne the slope of node n's weight at the material's centroid,
//   s_e = 0.7 rho h^2 / 12 sum_{n in e} G_n / m_n,   G_n = sum_e phi_e V |g_ne|^2 times the stiffness factor,
// where that is more; a fragment of a single cell may reach 1 / 0.7 of it.
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

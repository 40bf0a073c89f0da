// The lattice hexahedra node by node, in double precision: their energy (hex_kernel.h), and vertex block descent on it
// (Chen et al. 2024), the integrator that is stable at any step. As a function of one node, J is affine and the rest of
// the energy quadratic, so that each move goes to the minimum of a convex quadratic. Therefore the objective
//   sum_i m_i |x_i - y_i|^2 / (2 h^2) + E(x)
// never grows, however inverted the state, and no line search is needed. Plain code, a hundred times as slow as the
// explicit integrator: it is a safety net.
#pragma once

#include <span>
#include <vector>

#include "sim_server/deformation/hexa/hex_kernel.h"

namespace sectio {

class HexDescent {
 public:
  // The arguments must outlive this object.
  HexDescent(const HexLattice& lattice, const HexMaterial& material);

  double elastic_energy_j(std::span<const Vec3> position_world_m) const;
  // One sweep over all nodes of mass > 0; the others stay. Returns the longest displacement, m.
  double sweep(double step_s, std::span<const double> mass_kg, std::span<const Vec3> inertial_world_m,
               std::span<Vec3> position_world_m) const;
  // Minus the gradient of the elastic energy with respect to one node, and the Hessian.
  struct Block {
    Vec3 force_n = Vec3::Zero();
    Mat3 stiffness_n_per_m = Mat3::Zero();
  };
  Block block(std::uint32_t node, std::span<const Vec3> position_world_m) const;

 private:
  struct Corner {
    std::uint32_t cell, corner;
  };
  const HexLattice* lattice_;
  HexMaterial material_;
  std::vector<std::size_t> first_;  // by node: index of its first entry in corners_
  std::vector<Corner> corners_;
};

}  // namespace sectio

// The energy of the lattice hexahedra (hex_kernel.h) in double precision, for the implicit driver. Its Hessian is that
// of the modes, where the factor of d2J is kept within -a / (4 h) and a / (4 h), which makes it positive where a cell
// is crushed or turned inside out. Besides, vertex block descent (Chen et al. 2024), which smooths a wreck: as a
// function of one node, J is affine and the rest of the energy quadratic, so that each move goes to the minimum of a
// convex quadratic, and the objective sum_i m_i |x_i - y_i|^2 / (2 h^2) + E(x) never grows, however inverted the state.
#pragma once

#include <span>
#include <vector>

#include "sim_server/deformation/hexa/hex_energy.h"
#include "sim_server/deformation/hexa/hex_ties.h"
#include "sim_server/deformation/newton_step.h"

namespace sectio {

class HexDescent final : public ElasticEnergy {
 public:
  // The lattice must outlive this object.
  HexDescent(const HexLattice& lattice, const HexMaterial& material, HexTies ties = {});

  const HexTies& ties() const { return ties_; }
  void set_homes(const Pose& rest_world) { ties_.set_homes(*lattice_, rest_world); }

  double elastic_energy_j(std::span<const Vec3> position_world_m) const;
  double energy_j(std::span<const Vec3> position_world_m) override { return elastic_energy_j(position_world_m); }
  void add_forces(std::span<const Vec3> position_world_m, std::span<Vec3> force_n) override;
  void linearise(std::span<const Vec3> position_world_m) override;
  void add_product(std::span<Vec4f> p_m, std::span<Vec4f> force_n) const override;
  void add_blocks(std::span<Mat3> blocks_n_per_m) const override;
  // One sweep over all nodes of mass > 0; the others stay. Returns the longest displacement, m.
  double sweep(double step_s, std::span<const double> mass_kg, std::span<const Vec3> inertial_world_m,
               std::span<Vec3> position_world_m) const;
  // Minus the gradient of the elastic energy with respect to one node, and the Hessian.
  HexEnergy::Block block(std::uint32_t node, std::span<const Vec3> position_world_m) const;

 private:
  struct Corner {
    std::uint32_t cell, corner;
  };
  const HexLattice* lattice_;
  HexTies ties_;
  std::vector<HexEnergy> cells_;
  std::vector<std::size_t> first_;  // by node: index of its first entry in corners_
  std::vector<Corner> corners_;
  std::vector<Vec3> at_;  // the Hessian was taken here
};

}  // namespace sectio

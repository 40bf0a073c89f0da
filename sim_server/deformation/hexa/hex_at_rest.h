// The stiffness of lattice hexahedra at rest, along the axes of the grid: what HexEnergy::product() is there, in single
// precision and a fifth of the time.
#pragma once

#include <span>
#include <vector>

#include "sim_server/deformation/hexa/hex_kernel.h"

namespace sectio {

class HexAtRest {
 public:
  HexAtRest(const HexLattice& lattice, const HexMaterial& material);
  // Adds K p. Fourth components are scratch.
  void add_product(std::span<const Vec4f> p_m, std::span<Vec4f> force_n) const;

 private:
  struct Cell {
    std::array<std::uint32_t, 8> nodes;
    Vec3f offset, spread;
    float shear, bulk;  // phi mu h / 16, phi kappa h / 16
  };
  std::vector<Cell> cells_;
};

}  // namespace sectio

// Lattice hexahedra once more, in double precision and as plainly as possible: the energy of hex_kernel.h over a
// lattice's own nodes, its gradient and Hessian. The fast kernels are compared with it. Bodies of such cells at rest.
#pragma once

#include "sim_server/deformation/hexa/hex_kernel.h"
#include "tests/support/newton.h"

namespace sectio::test {

class HexReference final : public ElasticReference {
 public:
  HexReference(HexLattice lattice, const Lame& material);

  const HexLattice& lattice() const { return lattice_; }

  double energy_j(const Points& x) const override;

  Points forces_n(const Points& x) const override;

  // d^2 J / dx_a dx_b = [F (g_b x g_a)]_x, with [w]_x v = w x v.
  Sparse hessian(const Points& x) const override;

 private:
  // The sign at a corner of the modes along the axes of the bits of `mode`, and of their products.
  static double sign(std::size_t corner, std::size_t mode);
  double stiff_volume_m3(const HexCell& cell) const;
  Mat3 gradient(const HexCell& cell, const Points& x) const;

  HexLattice lattice_;
  double mu_, kappa_;
  std::array<Vec3, 8> slope_;
  std::array<std::array<double, 8>, 8> hourglass_;
};

}  // namespace sectio::test

// Lattice hexahedra once more, in double precision and as plainly as possible: the energy of hex_kernel.h over a
// lattice's own nodes, written with derivatives of the deformation at the material's centroid instead of modes, and its
// gradient and Hessian. The fast kernels are compared with it. Bodies of such cells at rest.
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

  // By differences of the forces.
  Sparse hessian(const Points& x) const override;

 private:
  using Corners = std::array<Vec3, 8>;
  using Derivatives = std::array<Vec3, 8>;

  Derivatives derivatives(const HexCell& cell, const Corners& x) const;
  double limit(const Mat3& f, const Derivatives& d) const;
  double energy_j(const HexCell& cell, const Corners& x) const;
  Corners forces_n(const HexCell& cell, const Corners& x) const;

  HexLattice lattice_;
  double mu_, kappa_;
};

}  // namespace sectio::test

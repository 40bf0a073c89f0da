// The energy of one cell of the lattice, in double precision, as a function of its modes. Pure functions. hex_kernel.h
// has the equation, and computes the same forces in single precision.
#pragma once

#include <array>
#include <span>

#include "sim_server/deformation/hexa/hex_kernel.h"

namespace sectio {

// n_k = sum over the corners of sign(k) x, where the bits of k say along which axes the sign changes: n_1, n_2, n_4 are
// slopes, n_3 (xy), n_5 (zx), n_6 (yz) and n_7 (xyz) hourglasses, and n_0 is eight times the middle.
using HexModes = std::array<Vec3, 8>;

HexModes modes_of(const HexCell& cell, std::span<const Vec3> position_m);
void to_modes(HexModes& corners);
// The transpose of to_modes(): from forces on modes to forces on corners.
void from_modes(HexModes& modes);
// The sign that a corner has in a mode.
double mode_sign(std::size_t corner, std::size_t mode);

class HexEnergy {
 public:
  HexEnergy(const HexCell& cell, const HexMaterial& material, double cell_m);

  double value_j(const HexModes& n) const;
  HexModes slope_n(const HexModes& n) const;  // dE/dn
  // The Hessian times p, made positive: the factor of d2J is kept within that of the body at rest, and the twist term
  // within its springs.
  HexModes product(const HexModes& n, const HexModes& p) const;

  // The energy is a convex quadratic in one corner, but for the twist term's limit f: minus its slope, and its Hessian.
  struct Block {
    Vec3 force_n = Vec3::Zero();
    Mat3 stiffness_n_per_m = Mat3::Zero();
  };
  Block block(const HexModes& n, std::size_t corner) const;

 private:
  template <class T>
  void shift(std::array<T, 8>& n) const;
  void shift_back(HexModes& f) const;
  double swelling(const HexModes& m) const;
  double limit(const HexModes& m) const;
  double springs(std::size_t mode) const;
  HexModes twist(const HexModes& m, double& value) const;

  double a_, b_, h_;  // phi mu h / 16, phi kappa / 64, edge
  Vec3 d_, i_;        // offset and spread of the material
};

}  // namespace sectio

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
template <class T>
void to_modes(std::array<T, 8>& m) {
  for (std::size_t step = 1; step < 8; step *= 2)
    for (std::size_t c = 0; c < 8; ++c) {
      if ((c & step) != 0) continue;
      const T sum = m[c] + m[c | step];
      m[c | step] -= m[c];
      m[c] = sum;
    }
}
// The transpose of to_modes(): from forces on modes to forces on corners.
template <class T>
void from_modes(std::array<T, 8>& m) {
  for (std::size_t step = 1; step < 8; step *= 2)
    for (std::size_t c = 0; c < 8; ++c) {
      if ((c & step) != 0) continue;
      const T sum = m[c] + m[c | step];
      m[c] -= m[c | step];
      m[c | step] = sum;
    }
}
// From modes about the middle of the cell to modes about the centroid of its material, in cells from the middle.
template <class T, class Offset>
void to_centroid(const Offset& d, std::array<T, 8>& n) {
  n[1] += d.z() * n[5];
  n[2] += d.z() * n[6];
  n[4] += d.y() * n[6];
  n[3] += d.z() * n[7];
  n[5] += d.y() * n[7];
  n[6] += d.x() * n[7];
  n[1] += d.y() * n[3];
  n[2] += d.x() * n[3];
  n[4] += d.x() * n[5];
}
// The transpose of to_centroid().
template <class T, class Offset>
void from_centroid(const Offset& d, std::array<T, 8>& f) {
  f[5] += d.x() * f[4];
  f[3] += d.y() * f[1] + d.x() * f[2];
  f[7] += d.z() * f[3] + d.y() * f[5] + d.x() * f[6];
  f[5] += d.z() * f[1];
  f[6] += d.z() * f[2] + d.y() * f[4];
}
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
  double swelling(const HexModes& m) const;
  double limit(const HexModes& m) const;
  double springs(std::size_t mode) const;
  HexModes twist(const HexModes& m, double& value) const;

  double a_, b_, h_;  // phi mu h / 16, phi kappa / 64, edge
  Vec3 d_, i_;        // offset and spread of the material
};

}  // namespace sectio

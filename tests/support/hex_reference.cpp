#include "tests/support/hex_reference.h"

#include <cmath>
#include <utility>

namespace sectio::test {

HexReference::HexReference(HexLattice lattice, const Lame& material)
    : lattice_(std::move(lattice)), mu_(material.mu_pa), kappa_(material.lambda_pa + material.mu_pa) {
  const double h = lattice_.grid.cell_m;
  for (std::size_t a = 0; a < 8; ++a) {
    slope_[a] = Vec3(sign(a, 1), sign(a, 2), sign(a, 4)) / (4 * h);
    for (std::size_t b = 0; b < 8; ++b) {
      hourglass_[a][b] = 0.5 * sign(a, 7) * sign(b, 7);
      for (const std::size_t mode : {3u, 5u, 6u}) hourglass_[a][b] += sign(a, mode) * sign(b, mode);
      hourglass_[a][b] *= mu_ * kHourglass / (8 * h * h);
    }
  }
}

double HexReference::energy_j(const Points& x) const {
  double energy = 0;
  for (const HexCell& cell : lattice_.cells) {
    const Mat3 f = gradient(cell, x);
    const double j = f.determinant();
    double density = mu_ * (0.5 * (f.squaredNorm() - 3) - (j - 1)) + 0.5 * kappa_ * (j - 1) * (j - 1);
    for (std::size_t a = 0; a < 8; ++a)
      for (std::size_t b = 0; b < 8; ++b) density += 0.5 * hourglass_[a][b] * x[cell.nodes[a]].dot(x[cell.nodes[b]]);
    energy += stiff_volume_m3(cell) * density;
  }
  return energy;
}

HexReference::Points HexReference::forces_n(const Points& x) const {
  Points force(x.size(), Vec3::Zero());
  for (const HexCell& cell : lattice_.cells) {
    const Mat3 f = gradient(cell, x);
    const Mat3 stress = mu_ * f + (kappa_ * (f.determinant() - 1) - mu_) * cofactor(f);
    for (std::size_t a = 0; a < 8; ++a) {
      Vec3 sum = stress * slope_[a];
      for (std::size_t b = 0; b < 8; ++b) sum += hourglass_[a][b] * x[cell.nodes[b]];
      force[cell.nodes[a]] -= stiff_volume_m3(cell) * sum;
    }
  }
  return force;
}

HexReference::Sparse HexReference::hessian(const Points& x) const {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(lattice_.cells.size() * 64 * 9);
  for (const HexCell& cell : lattice_.cells) {
    const Mat3 f = gradient(cell, x), c = cofactor(f);
    const double pressure = kappa_ * (f.determinant() - 1) - mu_;
    for (std::size_t a = 0; a < 8; ++a)
      for (std::size_t b = 0; b < 8; ++b) {
        const Vec3 w = f * slope_[b].cross(slope_[a]);
        Mat3 turn;
        turn << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
        const Mat3 k =
            stiff_volume_m3(cell) * ((mu_ * slope_[a].dot(slope_[b]) + hourglass_[a][b]) * Mat3::Identity() +
                                     kappa_ * (c * slope_[a]) * (c * slope_[b]).transpose() + pressure * turn);
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) entries.emplace_back(3 * cell.nodes[a] + i, 3 * cell.nodes[b] + j, k(i, j));
      }
  }
  const auto n = static_cast<Eigen::Index>(3 * x.size());
  Sparse h(n, n);
  h.setFromTriplets(entries.begin(), entries.end());
  return h;
}

double HexReference::sign(std::size_t corner, std::size_t mode) {
  double s = 1;
  for (std::size_t k = 0; k < 3; ++k)
    if ((mode >> k & 1) != 0 && (corner >> k & 1) == 0) s = -s;
  return s;
}

double HexReference::stiff_volume_m3(const HexCell& cell) const {
  return cell.fill * cell.stiffness * std::pow(lattice_.grid.cell_m, 3);
}

Mat3 HexReference::gradient(const HexCell& cell, const Points& x) const {
  Mat3 f = Mat3::Zero();
  for (std::size_t a = 0; a < 8; ++a) f += x[cell.nodes[a]] * slope_[a].transpose();
  return f;
}

}  // namespace sectio::test

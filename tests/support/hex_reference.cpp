#include "tests/support/hex_reference.h"

#include <cmath>
#include <utility>

namespace sectio::test {
namespace {

// Slope, along the axes of the bits of `along`, of the weight of a corner, at a point from -1 to 1.
double slope(std::size_t corner, std::size_t along, const Vec3& at) {
  double w = 1;
  for (std::size_t k = 0; k < 3; ++k) {
    const double sign = (corner >> k & 1) != 0 ? 1 : -1;
    w *= (along >> k & 1) != 0 ? sign / 2 : (1 + sign * at[static_cast<Eigen::Index>(k)]) / 2;
  }
  return w;
}

}  // namespace

HexReference::HexReference(HexLattice lattice, const Lame& material)
    : lattice_(std::move(lattice)), mu_(material.mu_pa), kappa_(material.lambda_pa + material.mu_pa) {}

// By the bits of the axes, with respect to coordinates from -1 to 1; [1], [2], [4] are h/2 times the columns of F.
HexReference::Derivatives HexReference::derivatives(const HexCell& cell, const Corners& x) const {
  Derivatives d;
  for (std::size_t along = 1; along < 8; ++along) {
    d[along].setZero();
    for (std::size_t a = 0; a < 8; ++a) d[along] += slope(a, along, cell.offset) * x[a];
  }
  return d;
}

double HexReference::energy_j(const HexCell& cell, const Corners& x) const {
  const double h = lattice_.grid.cell_m, to_world = 2 / h;
  const Derivatives d = derivatives(cell, x);
  Mat3 f;
  f << to_world * d[1], to_world * d[2], to_world * d[4];
  const double j = f.determinant(), x2 = cell.spread.x(), y2 = cell.spread.y(), z2 = cell.spread.z();
  double density = mu_ * (0.5 * (f.squaredNorm() - 3) - (j - 1)) + 0.5 * kappa_ * (j - 1) * (j - 1);
  const double squares = (x2 + y2) * d[3].squaredNorm() + (x2 + z2) * d[5].squaredNorm() +
                         (y2 + z2) * d[6].squaredNorm() + (x2 * y2 + y2 * z2 + z2 * x2) * d[7].squaredNorm();
  density += 0.5 * mu_ * 3 * kHourglass * to_world * to_world * squares;
  const double twisted =
      x2 * d[1].dot(d[3].cross(d[5])) + y2 * d[2].dot(d[6].cross(d[3])) + z2 * d[4].dot(d[5].cross(d[6]));
  density -= mu_ * kTwist * limit(f, d) * std::pow(to_world, 3) * twisted;
  return cell.fill * cell.stiffness * h * h * h * density;
}

double HexReference::limit(const Mat3& f, const Derivatives& d) const {
  const double h = lattice_.grid.cell_m;
  const double hourglasses = d[3].squaredNorm() + d[5].squaredNorm() + d[6].squaredNorm();
  return 2 / (1 + (f.squaredNorm() + kTangle * 4 / (h * h) * hourglasses) / 3);
}

HexReference::Corners HexReference::forces_n(const HexCell& cell, const Corners& x) const {
  const double h = lattice_.grid.cell_m, to_world = 2 / h, weight = cell.fill * cell.stiffness * h * h * h;
  const Derivatives d = derivatives(cell, x);
  Mat3 f;
  f << to_world * d[1], to_world * d[2], to_world * d[4];
  const double x2 = cell.spread.x(), y2 = cell.spread.y(), z2 = cell.spread.z();
  const double spring = mu_ * 3 * kHourglass * to_world * to_world;
  const double f2 = limit(f, d), twist = mu_ * kTwist * f2 * std::pow(to_world, 3);
  const Vec3 tx = x2 * d[3].cross(d[5]), ty = y2 * d[6].cross(d[3]), tz = z2 * d[5].cross(d[6]);
  const double twisted = d[1].dot(tx) + d[2].dot(ty) + d[4].dot(tz);
  const Mat3 stress = (mu_ + twist * twisted * f2 / 3) * f + (kappa_ * (f.determinant() - 1) - mu_) * cofactor(f);
  Derivatives slope_n{Vec3::Zero(),
                      to_world * stress.col(0) - twist * tx,
                      to_world * stress.col(1) - twist * ty,
                      spring * (x2 + y2) * d[3] - twist * (x2 * d[5].cross(d[1]) + y2 * d[2].cross(d[6])),
                      to_world * stress.col(2) - twist * tz,
                      spring * (x2 + z2) * d[5] - twist * (x2 * d[1].cross(d[3]) + z2 * d[6].cross(d[4])),
                      spring * (y2 + z2) * d[6] - twist * (y2 * d[3].cross(d[2]) + z2 * d[4].cross(d[5])),
                      spring * (x2 * y2 + y2 * z2 + z2 * x2) * d[7]};
  const double tangled = twist * twisted * f2 * kTangle * 4 / (3 * h * h);
  for (const std::size_t k : {3u, 5u, 6u}) slope_n[k] += tangled * d[k];
  Corners force;
  for (std::size_t a = 0; a < 8; ++a) {
    force[a].setZero();
    for (std::size_t along = 1; along < 8; ++along) force[a] -= weight * slope(a, along, cell.offset) * slope_n[along];
  }
  return force;
}

namespace {

std::array<Vec3, 8> corners_of(const HexCell& cell, const std::vector<Vec3>& x) {
  std::array<Vec3, 8> corners;
  for (std::size_t a = 0; a < 8; ++a) corners[a] = x[cell.nodes[a]];
  return corners;
}

}  // namespace

double HexReference::energy_j(const Points& x) const {
  double energy = 0;
  for (const HexCell& cell : lattice_.cells) energy += energy_j(cell, corners_of(cell, x));
  return energy;
}

HexReference::Points HexReference::forces_n(const Points& x) const {
  Points force(x.size(), Vec3::Zero());
  for (const HexCell& cell : lattice_.cells) {
    const Corners own = forces_n(cell, corners_of(cell, x));
    for (std::size_t a = 0; a < 8; ++a) force[cell.nodes[a]] += own[a];
  }
  return force;
}

HexReference::Sparse HexReference::hessian(const Points& x) const {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(lattice_.cells.size() * 64 * 9);
  const double step = 1e-5 * lattice_.grid.cell_m;
  for (const HexCell& cell : lattice_.cells)
    for (std::size_t b = 0; b < 8; ++b)
      for (int k = 0; k < 3; ++k) {
        Corners above = corners_of(cell, x), below = above;
        above[b][k] += step;
        below[b][k] -= step;
        const Corners f = forces_n(cell, above), g = forces_n(cell, below);
        for (std::size_t a = 0; a < 8; ++a)
          for (int i = 0; i < 3; ++i)
            entries.emplace_back(3 * cell.nodes[a] + i, 3 * cell.nodes[b] + k, (g[a][i] - f[a][i]) / (2 * step));
      }
  const auto n = static_cast<Eigen::Index>(3 * x.size());
  Sparse h(n, n);
  h.setFromTriplets(entries.begin(), entries.end());
  return h;
}

}  // namespace sectio::test

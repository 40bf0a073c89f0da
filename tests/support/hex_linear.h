// Lattice hexahedra for small displacements, in double precision: the stiffness that the model's energy has at rest,
// assembled over a lattice's own nodes, and bodies at rest under loads.
#pragma once

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <limits>

#include "sim_server/deformation/hexa/hex_kernel.h"

namespace sectio::test {

constexpr double kFree = std::numeric_limits<double>::quiet_NaN();

class HexLinear {
 public:
  using Points = std::vector<Vec3>;

  HexLinear(const HexLattice& lattice, const HexMaterial& material) : lattice_(lattice) {
    const double h = lattice.grid.cell_m, volume = h * h * h, mu = material.shear_pa, lambda = material.bulk_pa - mu;
    const auto sign = [](std::size_t c, std::size_t mode) {
      double s = 1;
      for (std::size_t k = 0; k < 3; ++k)
        if ((mode >> k & 1) != 0 && (c >> k & 1) == 0) s = -s;
      return s;
    };
    std::vector<Eigen::Triplet<double>> entries;
    for (const HexCell& cell : lattice.cells)
      for (std::size_t a = 0; a < 8; ++a)
        for (std::size_t b = 0; b < 8; ++b) {
          const Vec3 ga = Vec3(sign(a, 1), sign(a, 2), sign(a, 4)) / (4 * h);
          const Vec3 gb = Vec3(sign(b, 1), sign(b, 2), sign(b, 4)) / (4 * h);
          double hourglass = 0.5 * sign(a, 7) * sign(b, 7);
          for (const std::size_t mode : {3u, 5u, 6u}) hourglass += sign(a, mode) * sign(b, mode);
          Mat3 k = lambda * ga * gb.transpose() + mu * gb * ga.transpose();
          k.diagonal().array() += mu * ga.dot(gb) + 8 / (h * h) * mu * kHourglass * hourglass / 64;
          k *= cell.fill * cell.stiffness * volume;
          for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) entries.emplace_back(3 * cell.nodes[a] + i, 3 * cell.nodes[b] + j, k(i, j));
        }
    const auto n = static_cast<Eigen::Index>(3 * lattice.nodes.size());
    stiffness_.resize(n, n);
    stiffness_.setFromTriplets(entries.begin(), entries.end());
  }

  // `given`: displacements, kFree where they are what the load makes them.
  Points displacements_m(const Points& given, const Points& load_n) const {
    const auto n = stiffness_.rows();
    Eigen::VectorXd u = Eigen::VectorXd::Zero(n), f(n);
    std::vector<std::uint8_t> held(static_cast<std::size_t>(n), 0);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto node = static_cast<std::size_t>(i / 3);
      f[i] = load_n[node][i % 3];
      if (std::isnan(given[node][i % 3])) continue;
      held[static_cast<std::size_t>(i)] = 1;
      u[i] = given[node][i % 3];
    }
    f -= stiffness_ * u;
    Eigen::SparseMatrix<double> k = stiffness_;
    k.prune([&](Eigen::Index i, Eigen::Index j, double) {
      return (held[static_cast<std::size_t>(i)] == 0 && held[static_cast<std::size_t>(j)] == 0) || i == j;
    });
    for (Eigen::Index i = 0; i < n; ++i)
      if (held[static_cast<std::size_t>(i)] != 0) k.coeffRef(i, i) = 1, f[i] = 0;
    u += Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(k).solve(f);
    Points out;
    for (Eigen::Index i = 0; i < n; i += 3) out.emplace_back(u.segment<3>(i));
    return out;
  }
  // What pulls at the nodes to keep them there.
  Points forces_n(const Points& displacements_m) const {
    Eigen::VectorXd u(stiffness_.rows());
    for (Eigen::Index i = 0; i < u.size(); ++i) u[i] = displacements_m[static_cast<std::size_t>(i / 3)][i % 3];
    const Eigen::VectorXd f = stiffness_ * u;
    Points out;
    for (Eigen::Index i = 0; i < u.size(); i += 3) out.emplace_back(f.segment<3>(i));
    return out;
  }

 private:
  const HexLattice& lattice_;
  Eigen::SparseMatrix<double> stiffness_;
};

inline HexMaterial hex_material(double young_pa, double poisson, double density_kg_per_m3 = 1000) {
  const double mu = young_pa / (2 * (1 + poisson)), lambda = 2 * mu * poisson / (1 - 2 * poisson);
  return {mu, lambda + mu, density_kg_per_m3};
}

// Of a node by the faces in the plane x_axis = at that it is a corner of; adds up to the plane's filled area.
inline std::vector<double> areas_m2(const HexLattice& lattice, std::size_t axis, int at) {
  std::vector<double> area(lattice.nodes.size(), 0);
  const double h = lattice.grid.cell_m;
  for (const HexCell& cell : lattice.cells)
    for (std::size_t c = 0; c < 8; ++c)
      if (lattice.nodes[cell.nodes[c]][axis] == at) area[cell.nodes[c]] += 0.25 * cell.fill * h * h;
  return area;
}

}  // namespace sectio::test

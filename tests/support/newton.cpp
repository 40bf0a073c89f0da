#include "tests/support/newton.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

namespace sectio::test {

Mat3 cofactor(const Mat3& f) {
  Mat3 c;
  c.col(0) = f.col(1).cross(f.col(2));
  c.col(1) = f.col(2).cross(f.col(0));
  c.col(2) = f.col(0).cross(f.col(1));
  return c;
}

std::uint8_t held_if(bool condition) {
  return condition ? kHeldAll : 0;
}

std::vector<Vec3> newton_equilibrium(const ElasticReference& model, std::vector<Vec3> x,
                                     const std::vector<std::uint8_t>& held, const std::vector<Vec3>& load_n,
                                     double tolerance_n) {
  using Sparse = ElasticReference::Sparse;
  for (int n = 0; n < 60; ++n) {
    const std::vector<Vec3> f = model.forces_n(x);
    const auto is_held = [&](Eigen::Index i) { return (held[static_cast<std::size_t>(i / 3)] >> (i % 3) & 1) != 0; };
    Eigen::VectorXd r(static_cast<Eigen::Index>(3 * x.size()));
    for (Eigen::Index i = 0; i < r.size(); ++i) {
      const auto v = static_cast<std::size_t>(i / 3);
      r[i] = is_held(i) ? 0 : f[v][i % 3] + load_n[v][i % 3];
    }
    if (r.cwiseAbs().maxCoeff() < tolerance_n) break;
    Sparse h = model.hessian(x);
    h.prune([&](Eigen::Index i, Eigen::Index j, double) { return (!is_held(i) && !is_held(j)) || i == j; });
    for (Eigen::Index i = 0; i < r.size(); ++i)
      if (is_held(i)) h.coeffRef(i, i) = 1;
    const auto total = [&](const std::vector<Vec3>& at) {
      double energy = model.energy_j(at);
      for (std::size_t i = 0; i < at.size(); ++i) energy -= load_n[i].dot(at[i]);
      return energy;
    };
    const double before = total(x);
    std::vector<Vec3> next = x;
    // A Hessian that is not positive, or leads nowhere, gets a multiple of the unit matrix added.
    const double stiff = h.diagonal().cwiseAbs().mean();
    for (double shift = 0;; shift = std::max(1e-3 * stiff, 10 * shift)) {
      Sparse shifted = h;
      for (Eigen::Index i = 0; i < h.rows() && shift > 0; ++i) shifted.coeffRef(i, i) += shift;
      Eigen::SimplicialLDLT<Sparse> solver(shifted);
      const Eigen::VectorXd step = solver.solve(r);
      if (!(solver.vectorD().minCoeff() > 0) && shift < 1e3 * stiff) continue;
      double way = 1;
      for (;; way *= 0.5) {
        for (std::size_t i = 0; i < x.size(); ++i)
          next[i] = x[i] + way * step.segment<3>(static_cast<Eigen::Index>(3 * i));
        if (total(next) <= before + 1e-12 * std::abs(before) || way < 1e-4) break;
      }
      break;
    }
    x = next;
  }
  return x;
}

}  // namespace sectio::test

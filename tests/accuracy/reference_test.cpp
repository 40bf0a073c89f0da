// The bricks that all charts and many tests are compared with, by themselves.
#include <gtest/gtest.h>

#include "tests/support/brick_reference.h"

namespace sectio::test {
namespace {

TEST(Reference, bricks_are_consistent) {
  const BrickReference reference({2, 1, 1}, Vec3(0.2, 0.1, 0.1), lame(1e4, 0.45), Slit{0.1, 0.0});
  std::vector<Vec3> x = reference.nodes_m();
  EXPECT_EQ(x.size(), 45u + 6u) << "the slit's nodes are there twice";
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Vec3 p = x[i];
    x[i] = Vec3(1.1 * p.x() + 3 * p.y() * p.z(), 0.95 * p.y(), p.z() + 0.2 * p.x() + 0.001 * double(i % 5));
  }
  const auto hessian = reference.hessian(x);
  for (std::size_t v = 0; v < x.size(); v += 5)
    for (int k = 0; k < 3; ++k) {
      std::vector<Vec3> a = x, b = x;
      const double by = 1e-6;
      a[v][k] -= by, b[v][k] += by;
      EXPECT_NEAR(-(reference.energy_j(b) - reference.energy_j(a)) / (2 * by), reference.forces_n(x)[v][k], 1e-5);
      const auto fa = reference.forces_n(a), fb = reference.forces_n(b);
      for (std::size_t w = 0; w < x.size(); ++w)
        for (int m = 0; m < 3; ++m)
          EXPECT_NEAR(hessian.coeff(static_cast<Eigen::Index>(3 * w) + m, static_cast<Eigen::Index>(3 * v) + k),
                      (fa[w][m] - fb[w][m]) / (2 * by), 2e-3);
    }
  Vec3 load = Vec3::Zero();
  for (const Vec3& f : reference.body_load_n({1, 2, 3})) load += f;
  EXPECT_LT((load - 0.002 * Vec3(1, 2, 3)).norm(), 1e-12);
}

// PL^3 / 3EI + PL / (kappa G A), of a bar under a load over its end; a clamped end is a little stiffer than the beam's.
double over_timoshenko(int across, double poisson) {
  const double young = 1e4, load_n = 1e-6, l = 0.16, h = 0.02;
  const BrickReference bar({8 * across, across, across}, Vec3(l, h, h), lame(young, poisson));
  std::vector<std::uint8_t> held;
  std::vector<Vec3> load;
  std::size_t at_end = 0;
  for (const Vec3& p : bar.nodes_m()) {
    held.push_back(held_if(p.x() == 0));
    at_end += p.x() > l - 1e-9;
  }
  for (const Vec3& p : bar.nodes_m())
    load.push_back(p.x() > l - 1e-9 ? Vec3(0, 0, -load_n / double(at_end)) : Vec3(0, 0, 0));
  const auto x = bar.equilibrium(bar.nodes_m(), held, load, 1e-13);
  const double kappa = 10 * (1 + poisson) / (12 + 11 * poisson), shear = young / (2 * (1 + poisson));
  const double beam = load_n * l * l * l / (3 * young * h * h * h * h / 12) + load_n * l / (kappa * shear * h * h);
  return (h / 2 - bar.at({l, h / 2, h / 2}, x).z()) / beam;
}

TEST(Reference, bricks_bend_as_timoshenkos_beam_does) {
  for (const double poisson : {0.3, 0.45, 0.49}) {
    const double coarse = over_timoshenko(2, poisson), fine = over_timoshenko(3, poisson);
    EXPECT_NEAR(fine, poisson < 0.4 ? 0.99 : 0.97, 0.012) << poisson;
    EXPECT_GT(fine, coarse) << "from the stiff side";
    EXPECT_LT(fine - coarse, poisson < 0.47 ? 0.008 : 0.015) << "converged";
  }
}

}  // namespace
}  // namespace sectio::test

// Long steps of the implicit driver: its loops in both widths, coarse levels against products, what follows a cut, and
// how BDF2 swings.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/math/fixed_sequence.h"
#include "sim_server/deformation/rigid_aggregates.h"
#include "sim_server/deformation/tetra/tet_solid.h"
#include "tests/support/tet_shapes.h"
#include "tests/support/volume_settings.h"

namespace sectio::tetra_test {
namespace {

using test::Points;

TetMesh bar() {
  TetMesh mesh = test::tet_box(16, 4, 4, Vec3(0.2, 0.05, 0.05));
  test::jitter(mesh, 0.001);
  return mesh;
}
VolumeMaterial material(double damping_per_s = 25) {
  VolumeMaterial m;
  m.young_pa = 1e5;
  m.poisson = 0.4;
  m.damping_per_s = damping_per_s;
  return m;
}
std::vector<Vec3> shaken(std::vector<Vec3> x, double by_m) {
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = 1.02 * x[i] + by_m * fixed_vector(i);
  return x;
}
std::vector<Vec4f> directions(std::size_t count) {
  std::vector<Vec4f> p(count, Vec4f::Zero());
  for (std::size_t i = 0; i < count; ++i) p[i].head<3>() = fixed_vector(i + 1000).cast<float>();
  return p;
}

TEST(LongSteps, both_widths_compute_the_same_bits) {
  if (!has_avx512()) GTEST_SKIP() << "this processor has no AVX-512";
  const TetMesh mesh = bar();
  const TetSolid solid(mesh, material(), test::held_at_end(mesh, 1e-9, 1.0 / 60));
  const std::vector<Vec3> at = shaken(mesh.vertices_body_m, 1e-3);
  std::vector<std::vector<Vec4f>> found[2];
  for (const SimdWidth width : {SimdWidth::eight, SimdWidth::sixteen}) {
    std::vector<Vec4f> x(at.size(), Vec4f::Zero()), low = x, force = x, product = x, p = directions(at.size());
    for (std::size_t i = 0; i < at.size(); ++i) {
      x[i].head<3>() = at[i].cast<float>();
      low[i].head<3>() = (at[i] - x[i].head<3>().cast<double>()).cast<float>();
    }
    TetHessian hessian;
    update_pressures(solid.rows(), x, low, width);
    elastic_forces(solid.rows(), x, low, force, width);
    linearise(solid.rows(), x, hessian, width);
    add_product(solid.rows(), hessian, p, product, width);
    found[width == SimdWidth::sixteen] = {x, force, p, product};
  }
  EXPECT_EQ(found[0], found[1]);
}

// R^T K R by products against the blocks, on all pairs of groups.
TEST(LongSteps, coarse_blocks_are_those_of_the_product) {
  const TetMesh mesh = bar();
  TetSolid solid(mesh, material(), test::held_at_end(mesh, 1e-9, 1.0 / 60));
  TetEnergy& energy = solid.energy();
  const std::vector<Vec3> x = shaken(mesh.vertices_body_m, 1e-3);
  std::vector<Vec3> force(x.size(), Vec3::Zero());
  energy.add_forces(x, force);
  energy.linearise(x);
  RigidAggregates coarse;
  coarse.divide(energy.graph());
  ASSERT_FALSE(coarse.empty());
  coarse.begin(x);
  energy.add_to(coarse);
  std::uint32_t groups = 0;
  for (std::uint32_t i = 0; i < x.size(); ++i)
    if (coarse.group(i) != RigidAggregates::kNoGroup) groups = std::max(groups, coarse.group(i) + 1);
  ASSERT_GT(groups, 8u);
  const auto mode = [&](std::uint32_t i, int k) -> Vec3f {
    const Vec3f unit = Vec3f::Unit(k % 3);
    return k < 3 ? unit : unit.cross(coarse.arm(i).head<3>());
  };
  for (std::uint32_t b = 0; b < groups; b += 3)
    for (int k = 0; k < 6; ++k) {
      std::vector<Vec4f> p(x.size(), Vec4f::Zero()), y = p;
      for (std::uint32_t i = 0; i < x.size(); ++i)
        if (coarse.group(i) == b) p[i].head<3>() = mode(i, k);
      energy.add_product(p, y);
      std::vector<RigidAggregates::Vec6f> sums(groups, RigidAggregates::Vec6f::Zero());
      for (std::uint32_t i = 0; i < x.size(); ++i)
        if (coarse.group(i) != RigidAggregates::kNoGroup)
          for (int m = 0; m < 6; ++m) sums[coarse.group(i)][m] += mode(i, m).dot(y[i].head<3>());
      const float size = coarse.block(b, b)->norm();
      for (std::uint32_t a = 0; a <= b; ++a) {
        const RigidAggregates::Mat6f* const block = coarse.block(a, b);
        const RigidAggregates::Vec6f column =
            block ? RigidAggregates::Vec6f(block->col(k)) : RigidAggregates::Vec6f(RigidAggregates::Vec6f::Zero());
        EXPECT_LT((sums[a] - column).norm(), 1e-4f * size) << a << " " << b << " " << k;
      }
    }
}

// The driver after cuts: topology that it has seen before never shows.
TEST(LongSteps, nothing_is_stale_after_a_change) {
  const TetMesh mesh = bar();
  TetSolid solid(mesh, material(), test::held_at_end(mesh, 1e-9, 1.0 / 60), VolumeIntegrator::implicit_only);
  Points x = test::at_rest(mesh), v = test::still(x);
  for (int n = 0; n < 3; ++n) solid.step(x, v, {}, {});
  // Takes tetrahedra out of the upper half across the bar.
  TetChange change;
  change.first_added = static_cast<VertexId>(mesh.vertices_body_m.size());
  for (std::uint32_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    Vec3 middle = Vec3::Zero();
    for (const VertexId c : mesh.tetrahedra[t]) middle += mesh.vertices_body_m[c] / 4;
    if (middle.z() > 0.026 && std::abs(middle.x() - 0.105) < 0.006)
      change.tetrahedra.push_back({t, mesh.tetrahedra[t], kNoTetrahedron});
  }
  ASSERT_GT(change.tetrahedra.size(), 10u);
  solid.change(change);
  for (int n = 0; n < 20; ++n) {
    solid.step(x, v, {}, {});
    EXPECT_LT(solid.diagnostics().residual, NewtonStep::kLongTolerance);
    EXPECT_LT(solid.driver().products(), 60) << n;
  }
  EXPECT_EQ(solid.diagnostics().steps_not_met, 0u);
  // A driver that has never seen the whole bar takes the same step.
  TetMesh left = mesh;
  left.tetrahedra.clear();
  for (const Tetrahedron& t : solid.mesh().tetrahedra)
    if (t != kNoTetrahedron) left.tetrahedra.push_back(t);
  TetSolid fresh(left, material(), test::held_at_end(mesh, 1e-9, 1.0 / 60), VolumeIntegrator::implicit_only);
  std::vector<Vec3> at, old_force(x.size(), Vec3::Zero()), new_force = old_force;
  for (const Vec4f& p : x) at.push_back(p.head<3>().cast<double>());
  solid.energy().add_forces(at, old_force);
  fresh.energy().add_forces(at, new_force);
  double wrong = 0, size = 0;
  for (std::size_t i = 0; i < at.size(); ++i)
    wrong = std::max(wrong, (old_force[i] - new_force[i]).norm()), size = std::max(size, new_force[i].norm());
  EXPECT_LT(wrong, 1e-4 * size);
}

// A bar swings about its sag without damping: how its amplitude falls in a period.
double damping_ratio(double step_s) {
  const TetMesh mesh = test::tet_box(12, 3, 3, Vec3(0.2, 0.05, 0.05));
  TetSolid solid(mesh, material(0), test::held_at_end(mesh, 1e-9, step_s), VolumeIntegrator::implicit_only);
  Points x = test::at_rest(mesh), v = test::still(x);
  std::vector<double> z;
  for (double t = 0; t < 2; t += step_s) {
    solid.step(x, v, {}, {});
    z.push_back(double{std::ranges::min(x, {}, [](const Vec4f& p) { return p.z(); }).z()});
  }
  std::vector<double> lowest;
  for (std::size_t n = 1; n + 1 < z.size(); ++n)
    if (z[n] < z[n - 1] && z[n] <= z[n + 1]) lowest.push_back(z[n]);
  if (lowest.size() < 3) return 1;
  // The middle of the swing is half of the first depth.
  const double middle = lowest.front() / 2;
  return std::log((lowest.front() - middle) / (lowest.back() - middle)) /
         (2 * std::numbers::pi * static_cast<double>(lowest.size() - 1));
}

TEST(LongSteps, hardly_damp) {
  EXPECT_LT(damping_ratio(1.0 / 60), 0.01);
  EXPECT_GT(damping_ratio(1.0 / 60), -0.002);
}

}  // namespace
}  // namespace sectio::tetra_test

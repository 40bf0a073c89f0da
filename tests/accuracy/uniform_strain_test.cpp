// Affine deformations of the neo-Hookean solid: what the fast kernels compute against closed forms.
#include <gtest/gtest.h>

#include <cmath>

#include "sim_server/deformation/tetra/tet_solid.h"
#include "tests/support/tet_reference.h"
#include "tests/support/tet_shapes.h"

namespace sectio {
namespace {

constexpr double kSide = 0.1;

TetMesh block() {
  TetMesh mesh = test::tet_box(4, 4, 4, Vec3(kSide, kSide, kSide));
  for (Vec3& x : mesh.vertices_body_m) {
    // Inner vertices are moved, so that nothing is symmetric; the faces stay flat.
    const Vec3 s = x / kSide;
    const double bump = s.x() * (1 - s.x()) * s.y() * (1 - s.y()) * s.z() * (1 - s.z());
    x += 0.3 * kSide * bump * Vec3(1, -0.7, 0.5);
  }
  return mesh;
}

struct Forces {
  Vec3 on_x_end = Vec3::Zero();  // all that the face x = side pulls at
  double worst_inside = 0;
};

Forces forces_under(const Mat3& f, double young_pa, double poisson) {
  const TetMesh mesh = block();
  VolumeMaterial material;
  material.young_pa = young_pa;
  material.poisson = poisson;
  const TetSolid solid(mesh, material, {});
  std::vector<Vec4f> x(mesh.vertices_body_m.size(), Vec4f::Zero());
  for (std::size_t i = 0; i < x.size(); ++i) x[i].head<3>() = (f * mesh.vertices_body_m[i]).cast<float>();
  std::vector<Vec3> force(x.size());
  solid.elastic_forces_n(x, force);
  Forces all;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Vec3& home = mesh.vertices_body_m[i];
    if (home.x() == kSide) all.on_x_end -= force[i];
    if (home.minCoeff() > 0 && home.maxCoeff() < kSide) all.worst_inside = std::max(all.worst_inside, force[i].norm());
  }
  return all;
}

constexpr double kArea = kSide * kSide;

TEST(A_accuracy, A_1_an_affine_deformation_leaves_the_inside_in_balance) {
  Mat3 f;
  f << 1.2, 0.1, -0.05, 0.02, 0.9, 0.15, 0.1, -0.1, 1.05;
  EXPECT_LT(forces_under(f, 1e4, 0.45).worst_inside, 2e-5 * 1e4 * kArea);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(1, Vec3(1, 1, -2).normalized()).toRotationMatrix();
  EXPECT_LT(forces_under(turn, 1e4, 0.45).on_x_end.norm(), 1e-5 * 1e4 * kArea);
}

// J = 1 + (1 - 2 nu)(1 - 1/l), lateral stretch sqrt(J / l), P / E = (l - J / l^2) / (2 (1 + nu))
TEST(A_accuracy, A_2_uniaxial_stretch_with_free_sides) {
  struct Case {
    double nu, l, stress_over_e;
  };
  for (const Case& c : {Case{0.45, 0.7, -0.432191}, Case{0.45, 1.1, 0.0917381}, Case{0.45, 1.3, 0.239527},
                        Case{0.45, 2.0, 0.599138}, Case{0.3, 1.5, 0.383191}}) {
    const double j = 1 + (1 - 2 * c.nu) * (1 - 1 / c.l), lateral = std::sqrt(j / c.l);
    const Forces forces = forces_under(Vec3(c.l, lateral, lateral).asDiagonal(), 1e4, c.nu);
    EXPECT_NEAR(forces.on_x_end.x() / kArea / 1e4, c.stress_over_e, 1e-4) << c.nu << " " << c.l;
    EXPECT_LT(std::hypot(forces.on_x_end.y(), forces.on_x_end.z()), 1e-4 * 1e4 * kArea);
  }
}

TEST(A_accuracy, A_3_simple_shear) {
  const double gamma = 0.5, mu = 1e4 / 2.9;
  Mat3 f = Mat3::Identity();
  f(1, 0) = gamma;  // y is sheared along x: traction on the face x = side
  const Forces forces = forces_under(f, 1e4, 0.45);
  EXPECT_NEAR(forces.on_x_end.y() / kArea, mu * gamma, 1e-4 * mu);
  EXPECT_NEAR(mu * gamma, 1724.14, 0.01);
  // The normal of that face turns with the shear: P x = mu e_x - mu cof(F) e_x = mu gamma^2 ... 0 along x here.
  EXPECT_NEAR(forces.on_x_end.x() / kArea, 0, 1e-4 * mu);
}

TEST(A_accuracy, A_4_hydrostatic) {
  for (const double s : {0.8, 0.95, 1.1, 1.3}) {
    const auto [mu, lambda] = test::lame(1e4, 0.45);
    const double stress = mu * s + ((lambda + mu) * (s * s * s - 1) - mu) * s * s;
    EXPECT_NEAR(forces_under(s * Mat3::Identity(), 1e4, 0.45).on_x_end.x() / kArea, stress,
                1e-4 * std::max(std::abs(stress), 1e4));
  }
}

// The reference itself, on which the other tests rest: its gradient and Hessian by differences.
TEST(A_accuracy, the_reference_is_consistent) {
  TetMesh mesh = test::tet_box(2, 2, 2, Vec3(kSide, kSide, kSide));
  test::jitter(mesh, 0.008);
  for (const bool nodal : {false, true}) {
    const test::TetReference reference(mesh, test::lame(1e4, 0.45), nodal);
    std::vector<Vec3> x = mesh.vertices_body_m;
    for (Vec3& p : x) p = Vec3(1.1 * p.x() + 3 * p.y() * p.z(), 0.95 * p.y(), p.z() + 0.2 * p.x());
    const auto hessian = reference.hessian(x);
    for (std::size_t v = 0; v < x.size(); v += 3)
      for (int k = 0; k < 3; ++k) {
        std::vector<Vec3> a = x, b = x;
        const double by = 1e-6;
        a[v][k] -= by, b[v][k] += by;
        EXPECT_NEAR(-(reference.energy_j(b) - reference.energy_j(a)) / (2 * by), reference.forces_n(x)[v][k], 1e-6);
        const auto fa = reference.forces_n(a), fb = reference.forces_n(b);
        for (std::size_t w = 0; w < x.size(); ++w)
          for (int m = 0; m < 3; ++m)
            EXPECT_NEAR(hessian.coeff(static_cast<Eigen::Index>(3 * w) + m, static_cast<Eigen::Index>(3 * v) + k),
                        (fa[w][m] - fb[w][m]) / (2 * by), 1e-3)
                << nodal;
      }
  }
}

// And the fast kernels compute the reference's forces.
TEST(A_accuracy, fast_forces_are_the_reference_s) {
  TetMesh mesh = test::tet_box(4, 3, 3, Vec3(0.08, 0.06, 0.06));
  test::jitter(mesh, 0.003);
  const test::TetReference reference(mesh, test::lame(6000, 0.45));
  const TetSolid solid(mesh, {}, {});
  std::vector<Vec4f> x(mesh.vertices_body_m.size(), Vec4f::Zero());
  std::vector<Vec3> at(x.size()), force(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Vec3& p = mesh.vertices_body_m[i];
    x[i].head<3>() = Vec3(1.2 * p.x() + 4 * p.y() * p.z(), 0.9 * p.y(), p.z() - 0.3 * p.x()).cast<float>();
    at[i] = x[i].head<3>().cast<double>();
  }
  solid.elastic_forces_n(x, force);
  const std::vector<Vec3> expected = reference.forces_n(at);
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_LT((force[i] - expected[i]).norm(), 1e-5 * 6000 * 0.06 * 0.06);
}

}  // namespace
}  // namespace sectio

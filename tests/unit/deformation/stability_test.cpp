// The bound on the step, and the stability of a body after a cut.
#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>

#include "sim_server/deformation/spring_star.h"
#include "tests/support/random.h"
#include "tests/unit/deformation/shapes.h"

namespace sectio::deformation_test {
namespace {

using test::MeshEditor;
using test::Particles;

// The longest stable explicit step.
double limit_s(const TriangleMesh& mesh, const SurfaceSpringMaterial& material) {
  SurfaceSpringSettings settings;
  settings.adapts = false;
  return SurfaceSprings(mesh, {}, material, settings).largest_stable_step_s();
}

bool stays_bounded(const TriangleMesh& mesh, const SurfaceSpringMaterial& material, double step_s) {
  SurfaceSpringSettings settings = test::no_gravity(step_s);
  settings.adapts = false;
  SurfaceSprings springs(mesh, {}, material, settings);
  Particles p(mesh, {});
  test::Random random(1);
  std::uniform_real_distribution<float> unit(-1e-5f, 1e-5f);
  for (Vec4f& x : p.x) x.head<3>() += Vec3f(unit(random), unit(random), unit(random));
  p.run(springs, 3000);
  return springs.clamped() == 0 && springs.first_bad_vertex() == kNone && p.speed() < 0.05;
}

TEST(StableStep, bound_holds_and_is_within_a_factor_of_two) {
  for (const double damping : {0.0, 25.0, 400.0}) {
    for (const double radius : {0.004, 0.008, 0.05}) {
      SurfaceSpringMaterial material;
      material.damping_per_s = damping;
      material.foundation_radius_m = radius;
      const TriangleMesh mesh = test::organ();
      const double bound = limit_s(mesh, material);
      for (const double rung : {0.5, 0.8, 0.95, 1.0}) {
        EXPECT_TRUE(stays_bounded(mesh, material, rung * bound)) << damping << " " << radius << " " << rung;
      }
      EXPECT_FALSE(stays_bounded(mesh, material, 2.0 * bound)) << damping << " " << radius;
    }
  }
}

TEST(StableStep, follows_the_inverse_root_of_youngs_modulus) {
  SurfaceSpringMaterial material;
  material.damping_per_s = 0;
  const TriangleMesh mesh = test::organ(2);
  const double soft = limit_s(mesh, material);
  material.young_pa *= 100;
  EXPECT_NEAR(limit_s(mesh, material) / soft, 0.1, 1e-9);
}

TEST(StableStep, is_infinite_for_a_body_that_cannot_move_and_limited_by_damping_alone) {
  SurfaceSpringMaterial material;
  material.damping_per_s = 0;
  SurfaceSpringSettings settings;
  settings.fixed = [](const Vec3&) { return true; };
  const TriangleMesh mesh = test::organ(1);
  EXPECT_TRUE(std::isinf(SurfaceSprings(mesh, {}, material, settings).largest_stable_step_s()));
  material.damping_per_s = 50;
  EXPECT_NEAR(SurfaceSprings(mesh, {}, material, settings).largest_stable_step_s(), 2.0 / 50, 1e-12);
}

TEST(StableStep, eigenvalue_bound_is_tight_from_above) {
  test::Random random(2);
  std::normal_distribution<double> normal;
  for (int n = 0; n < 200; ++n) {
    Mat3 b;
    for (int i = 0; i < 9; ++i) b(i) = normal(random);
    const Mat3 a = b * b.transpose() * std::pow(10.0, n % 20 - 10);
    const double exact = Eigen::SelfAdjointEigenSolver<Mat3>(a).eigenvalues().maxCoeff();
    EXPECT_GE(largest_eigenvalue_bound(a), exact * (1 - 1e-12));
    EXPECT_LE(largest_eigenvalue_bound(a), exact * 1.036);
    FourSymmetric four;
    for (std::size_t k = 0; const auto& [i, j] : {std::pair{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}})
      four[k++] << a(i, j), 0, 2 * a(i, j), a(i, j);
    const Eigen::Array4d bounds = largest_eigenvalue_bounds(four) / largest_eigenvalue_bound(a);
    EXPECT_LT((bounds - Eigen::Array4d(1, 0, 2, 1)).abs().maxCoeff(), 1e-12);
  }
  EXPECT_EQ(largest_eigenvalue_bound(Mat3::Zero()), 0);
}

constexpr double kEnd = 0.05;

// Splits near the end of an edge leave slivers that are unstable at the step; added mass keeps it stable.
TEST(MassScaling, keeps_the_step_after_slivers_are_cut) {
  test::Random random(7);
  TriangleMesh mesh = test::organ();
  MeshEditor editor(mesh);
  SurfaceSpringSettings settings;
  settings.given_gravity_m_per_s2 = Vec3::Zero();
  settings.step_s = 0.9 * limit_s(mesh, {});
  SurfaceSprings springs(mesh, {}, {}, settings);
  Particles p(mesh, {});
  for (int n = 0; n < 60; ++n) {
    const auto t = static_cast<TriangleId>(random() % mesh.triangle_slots());
    const std::vector<VertexId> touched = editor.split_edge(mesh, t, static_cast<int>(random() % 3), kEnd);
    mesh = editor.mesh();
    p.grow(mesh);
    p.x[touched.back()] = static_cast<float>(1 - kEnd) * p.x[touched[0]] + static_cast<float>(kEnd) * p.x[touched[1]];
    springs.update(mesh, touched);
    EXPECT_GE(springs.largest_stable_step_s(), settings.step_s);
    p.run(springs, 20);
  }
  EXPECT_LT(limit_s(mesh, {}), 0.5 * settings.step_s);
  EXPECT_GT(springs.diagnostics().added_mass_fraction, 0);
  EXPECT_LT(springs.diagnostics().added_mass_fraction, 1.5);
  p.run(springs, 3000);
  EXPECT_EQ(springs.clamped(), 0u);
  EXPECT_EQ(springs.first_bad_vertex(), kNone);
  EXPECT_LT(p.speed(), 1e-4);
  // The weight is that of the physical mass, so the sag doesn't change.
  double sag = 0;
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    sag -= springs.mass_kg(v) * (p.at(v) - mesh.rest_body_m(v)).z();
    EXPECT_LT((p.at(v) - mesh.rest_body_m(v)).norm(), 0.001);
  }
  double mass = 0;
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) mass += springs.mass_kg(v);
  const double k_w = 2 * 6000 / (1 - 0.45 * 0.45) / (M_PI * 0.008);
  EXPECT_NEAR(sag / mass, 1060 * 9.81 * 0.008 / k_w, 5e-6);
}

TEST(MassScaling, control_the_same_slivers_blow_up_without_it) {
  test::Random random(7);
  TriangleMesh mesh = test::organ();
  MeshEditor editor(mesh);
  const double step = 0.9 * limit_s(mesh, {});
  for (int n = 0; n < 60; ++n) {
    const auto t = static_cast<TriangleId>(random() % mesh.triangle_slots());
    editor.split_edge(mesh, t, static_cast<int>(random() % 3), kEnd);
    mesh = editor.mesh();
  }
  EXPECT_FALSE(stays_bounded(mesh, {}, step));
}

// The same bits as steps of a part's length.
TEST(FineSurface, divides_a_step_that_is_beyond_its_stable_one) {
  const TriangleMesh mesh = test::organ();
  SurfaceSpringMaterial stiff;
  stiff.skin_thickness_m = 0.2;
  SurfaceSpringSettings settings = test::no_gravity(0.001);
  SurfaceSprings divided(mesh, {}, stiff, settings);
  ASSERT_GT(divided.parts(), 1);
  EXPECT_GE(divided.largest_stable_step_s(), settings.step_s);
  EXPECT_EQ(divided.diagnostics().added_mass_fraction, 0);
  settings.step_s /= divided.parts();
  SurfaceSprings short_steps(mesh, {}, stiff, settings);
  ASSERT_EQ(short_steps.parts(), 1);
  test::Random random(2);
  Particles p(mesh, {});
  std::uniform_real_distribution<float> unit(-0.1f, 0.1f);
  for (Vec4f& v : p.v) v.head<3>() = Vec3f(unit(random), unit(random), unit(random));
  Particles q = p;
  p.run(divided, 50);
  q.run(short_steps, 50 * divided.parts());
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) ASSERT_EQ(p.x[v], q.x[v]) << v;
  EXPECT_EQ(divided.diagnostics().implicit_steps, 0u);

  stiff.skin_thickness_m = 100;
  const SurfaceSprings too_stiff(mesh, {}, stiff, test::no_gravity(0.001));
  EXPECT_EQ(too_stiff.parts(), SurfaceSprings::kMostParts);
  EXPECT_LT(too_stiff.largest_stable_step_s(), 0.001) << "a body refuses it";
}

TEST(FineSurface, that_is_fixed_stays_under_its_weight) {
  const TriangleMesh mesh = test::organ();
  SurfaceSpringMaterial stiff;
  stiff.skin_thickness_m = 0.2;
  SurfaceSpringSettings settings;
  settings.fixed = [](const Vec3& rest_world_m) { return rest_world_m.z() < 0; };
  SurfaceSprings divided(mesh, {}, stiff, settings);
  ASSERT_GT(divided.parts(), 1);
  Particles p(mesh, {});
  const Particles start = p;
  p.run(divided, 50);
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    if (mesh.rest_body_m(v).z() >= 0) continue;
    ASSERT_EQ(p.x[v], start.x[v]) << v;
  }
}

}  // namespace
}  // namespace sectio::deformation_test

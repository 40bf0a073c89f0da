#include "sim_server/deformation/tetra/tet_solid.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/pressed_block.h"
#include "tests/support/tet_shapes.h"
#include "tests/support/volume_settings.h"

namespace sectio::tetra_test {
namespace {

using test::at_rest;
using test::Points;
using test::still;

TetMesh block(int n = 4) {
  TetMesh mesh = test::tet_box(2 * n, n, n, Vec3(0.1, 0.05, 0.05));
  test::jitter(mesh, 0.05 * 0.15 / n);
  return mesh;
}
int inverted(const TetMesh& mesh, const Points& x) {
  int count = 0;
  const auto at = [&](VertexId v) -> Vec3 { return x[v].head<3>().cast<double>(); };
  for (const Tetrahedron& t : mesh.tetrahedra) count += tet_volume_m3(at(t[0]), at(t[1]), at(t[2]), at(t[3])) <= 0;
  return count;
}

TEST(TetKernel, registers_of_8_and_of_16_give_the_same_bits) {
  if (!has_avx512()) GTEST_SKIP() << "this processor has no AVX-512";
  const TetMesh mesh = block();
  const TetSolid solid(mesh, {}, test::held_at_end(mesh, 0.004));
  Points x = at_rest(mesh);
  for (Vec4f& p : x) p.x() += 3 * p.y() * p.z();
  Points a = x, b = x, va = still(x), vb = va;
  const VelocityUpdate update{0.99f, Vec3f(0, 0, -0.001f), 5};
  EXPECT_EQ(update_pressures(solid.rows(), true, a, SimdWidth::eight),
            update_pressures(solid.rows(), true, b, SimdWidth::sixteen));
  update_velocities(solid.rows(), update, a, va, SimdWidth::eight);
  update_velocities(solid.rows(), update, b, vb, SimdWidth::sixteen);
  EXPECT_EQ(a, b);
  EXPECT_EQ(va, vb);
  std::vector<TetBlockColumn> room(3 * solid.rows().most_faces());
  const std::span<float> scratch(room.data()->bulk.data(), room.size() * kLanes);
  const float moved = descend(solid.rows(), 0.001f, x, a, scratch, SimdWidth::eight);
  EXPECT_EQ(moved, descend(solid.rows(), 0.001f, x, b, scratch, SimdWidth::sixteen));
  EXPECT_GT(moved, 0);
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i].head<3>(), b[i].head<3>());
}

class Descent : public ::testing::TestWithParam<double> {};

// The objective never grows, without line search, whatever the step and however inverted the start.
TEST_P(Descent, never_raises_the_objective_and_mends_what_is_inverted) {
  const TetMesh mesh = block(3);
  VolumeMaterial material;
  material.poisson = GetParam();
  const double h = 0.016;
  const TetSolid solid(mesh, material, test::weightless(h));
  const Points y = at_rest(mesh);
  for (const int kind : {0, 1, 2}) {
    Points x = y;
    std::uint32_t seed = 7;
    for (Vec4f& p : x) {
      if (kind == 0) p.z() = 0.02f * p.z();  // flattened
      if (kind == 1) p.x() = -p.x();         // mirrored
      for (int k = 0; kind == 2 && k < 3; ++k) {
        seed = seed * 1664525 + 1013904223;
        p[k] = 0.1f * static_cast<float>(seed >> 8) / (1 << 24);  // scrambled
      }
    }
    std::vector<TetBlockColumn> room(3 * solid.rows().most_faces());
    update_pressures(solid.rows(), false, x);
    const double first = solid.objective_j(x, y, h);
    double before = first;
    for (int n = 0; n < (GetParam() > 0.47 ? 2000 : 300); ++n) {
      descend(solid.rows(), static_cast<float>(h), y, x, {room.data()->bulk.data(), room.size() * kLanes});
      const double after = solid.objective_j(x, y, h);
      ASSERT_LE(after, before + 1e-6 * before + 1e-7 * first) << "kind " << kind << " sweep " << n;
      before = after;
    }
    EXPECT_EQ(inverted(mesh, x), 0) << kind;
  }
}
INSTANTIATE_TEST_SUITE_P(poisson, Descent, ::testing::Values(0.3, 0.45, 0.49));

TEST(TetSolid, both_integrators_come_to_rest_in_the_same_place) {
  const TetMesh mesh = block(2);
  VolumeMaterial soft;
  soft.young_pa = 20000;
  Points ends[2];
  for (const VolumeIntegrator driver : {VolumeIntegrator::automatic, VolumeIntegrator::implicit_only}) {
    TetSolid solid(mesh, soft, test::held_at_end(mesh, 0.004), driver);
    Points x = at_rest(mesh), v = still(x);
    for (int n = 0; n < 1500; ++n) solid.step(x, v, {}, {});
    EXPECT_EQ(solid.diagnostics().implicit_steps, 0u);
    EXPECT_EQ(solid.last_step_was_implicit(), driver == VolumeIntegrator::implicit_only);
    ends[driver == VolumeIntegrator::automatic ? 0 : 1] = x;
  }
  double sag = 0, apart = 0;
  for (std::size_t i = 0; i < ends[0].size(); ++i) {
    sag = std::max(sag, std::abs(mesh.vertices_body_m[i].z() - double{ends[0][i].z()}));
    apart = std::max(apart, double{(ends[0][i] - ends[1][i]).head<3>().norm()});
  }
  EXPECT_GT(sag, 0.005);
  EXPECT_LT(apart, 0.01 * sag);
}

// Two plates squeeze the body to a third, at which the substep of the rest state is unstable, and release it.
TEST(TetSolid, the_implicit_driver_takes_over_where_the_bound_says_so_and_hands_back) {
  const TetMesh mesh = block(3);
  VolumeMaterial material;
  material.poisson = 0.49;
  TetSolid solid(mesh, material, test::weightless(0.001));
  Points x = at_rest(mesh), v = still(x);
  std::vector<PointConstraint> plates;
  std::vector<VertexId> pressed;
  for (VertexId i = 0; i < x.size(); ++i)
    if (x[i].x() < 0.003f || x[i].x() > 0.097f) pressed.push_back(i);
  for (int n = 0; n < 150; ++n) {
    plates.clear();
    for (const VertexId i : pressed) {
      const double squeeze = 1 - 0.7 * std::min(1.0, n / 100.0);
      Vec3 at = mesh.vertices_body_m[i];
      at.x() = 0.05 + squeeze * (at.x() - 0.05);
      plates.push_back(hold(i, at));
    }
    std::vector<Reaction> reactions(plates.size());
    solid.step(x, v, plates, reactions);
  }
  EXPECT_GT(solid.diagnostics().implicit_steps, 0u);
  EXPECT_EQ(solid.first_bad_vertex(), kNone);
  for (int n = 0; n < 600; ++n) solid.step(x, v, {}, {});
  EXPECT_FALSE(solid.last_step_was_implicit());
  EXPECT_EQ(inverted(mesh, x), 0);
  EXPECT_LT(solid.elastic_energy_j(x), 1e-4 * 6000 * 0.05 * 0.05 * 0.1);
}

// In stiff, thin tissue the pressures' rounding is more than the tolerance's share of so little weight.
TEST(TetSolid, the_implicit_driver_meets_its_tolerance_in_stiff_and_thin_tissue_as_far_as_rounding_lets_it) {
  const TetMesh mesh = test::tet_box(28, 4, 3, Vec3(0.14, 0.019, 0.013));
  VolumeMaterial material;
  material.young_pa = 1.3e6;
  TetSolid solid(mesh, material, test::held_at_end(mesh, 0.001));
  Points x = at_rest(mesh), v = still(x);
  for (std::size_t i = 0; i < x.size(); ++i) v[i].z() = 4 * x[i].x() / 0.14f;
  for (int n = 0; n < 30; ++n) {
    solid.use_stable_driver(1);
    solid.step(x, v, {}, {});
    ASSERT_TRUE(solid.last_step_was_implicit());
  }
  EXPECT_EQ(solid.diagnostics().steps_not_met, 0u);
  EXPECT_LT(solid.diagnostics().residual, 0.15);
}

TEST(TetSolid, a_held_body_weighs_what_it_weighs) {
  const TetMesh mesh = block(2);
  VolumeSettings settings;
  TetSolid solid(mesh, {}, settings);
  Points x = at_rest(mesh), v = still(x);
  std::vector<PointConstraint> top;
  double mass = 0;
  for (VertexId i = 0; i < x.size(); ++i) {
    mass += solid.mass_kg(i);
    if (x[i].z() > 0.046f) top.push_back(hold(i, mesh.vertices_body_m[i]));
  }
  std::vector<Reaction> reactions(top.size());
  for (int n = 0; n < 1500; ++n) solid.step(x, v, top, reactions);
  Vec3 force = Vec3::Zero();
  for (const Reaction& r : reactions) force += r.force_on_tool_n;
  EXPECT_NEAR(force.z(), -mass * 9.81, 2e-3 * mass * 9.81);
  EXPECT_NEAR(mass, 1060 * check(mesh).volume_m3, 1e-9);
}

TEST(TetSolid, both_drivers_feel_the_same_force) {
  double force_n[2];
  for (const VolumeIntegrator driver : {VolumeIntegrator::automatic, VolumeIntegrator::implicit_only})
    force_n[driver == VolumeIntegrator::implicit_only] = test::force_on_pressed_block_n(
        [&](const TetMesh& mesh, const VolumeMaterial& material, const VolumeSettings& settings) {
          return std::make_unique<TetSolid>(mesh, material, settings, driver);
        });
  EXPECT_NEAR(force_n[1], force_n[0], 0.02 * force_n[0]);
}

TEST(TetSolid, A_19_free_fall) {
  const TetMesh mesh = block(2);
  VolumeMaterial material;
  material.damping_per_s = 0;
  TetSolid solid(mesh, material, {});
  Points x = at_rest(mesh), v = still(x);
  for (int n = 0; n < 200; ++n) solid.step(x, v, {}, {});
  const double h = 0.001 / solid.substeps(), t = 0.2;
  for (std::size_t i = 0; i < x.size(); ++i)  // symplectic Euler: t (t + h) / 2
    EXPECT_NEAR(mesh.vertices_body_m[i].z() - double{x[i].z()}, 0.5 * 9.81 * t * (t + h), 1e-4 * 0.5 * 9.81 * t * t);
}

// The accuracy tests have the same for a hundred times as long.
TEST(TetSolid, A_18_momentum_and_energy_of_a_spinning_stretched_body) {
  const TetMesh mesh = test::tet_box(4, 2, 2, Vec3(0.1, 0.05, 0.05));
  VolumeMaterial material;
  material.damping_per_s = 0;
  TetSolid solid(mesh, material, test::weightless(0.0005));
  Points x = at_rest(mesh), v = still(x);
  for (std::size_t i = 0; i < x.size(); ++i) {
    x[i].head<3>() = (1.05 * (mesh.vertices_body_m[i] - Vec3(0.05, 0.025, 0.025))).cast<float>();
    v[i].head<3>() = Vec3f(1, 2, 3).cross(x[i].head<3>()) + Vec3f(0.01f, 0, 0);
  }
  const auto momenta = [&] {
    Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
    double energy = solid.elastic_energy_j(x);
    for (VertexId i = 0; i < x.size(); ++i) {
      const Vec3 p = solid.mass_kg(i) * v[i].head<3>().cast<double>();
      linear += p;
      angular += x[i].head<3>().cast<double>().cross(p);
      energy += 0.5 * p.dot(v[i].head<3>().cast<double>());
    }
    return std::tuple(linear, angular, energy);
  };
  const auto [p0, l0, e0] = momenta();
  double mean = 0;
  for (int n = 0; n < 200; ++n) {
    solid.step(x, v, {}, {});
    mean += std::get<2>(momenta()) / 200;
  }
  const auto [p1, l1, e1] = momenta();
  EXPECT_LT((p1 - p0).norm(), 5e-6 * p0.norm());
  EXPECT_LT((l1 - l0).norm(), 2e-4 * l0.norm());
  EXPECT_NEAR(mean, e0, 0.02 * e0);
  EXPECT_EQ(solid.diagnostics().implicit_steps, 0u);
}

// Below the stable limit at rest no perturbation grows, above it all do.
TEST(TetSolid, the_predicted_limit_is_the_limit) {
  const TetMesh mesh = block(2);
  VolumeMaterial material;
  material.damping_per_s = 0;
  const TetSolid solid(mesh, material, test::weightless(1e-5));
  const double limit = solid.explicit_limit_s() / 0.6;
  for (const double k : {0.95, 1.1}) {
    TetRows rows = solid.rows();
    std::vector<TetVertex> vertices(mesh.vertices_body_m.size());
    for (VertexId i = 0; i < vertices.size(); ++i) vertices[i].inverse_mass = 1 / solid.mass_kg(i);
    rows.set(vertices, k * limit);
    Points x = at_rest(mesh), v = still(x);
    for (std::size_t i = 0; i < x.size(); ++i) x[i].x() += 1e-5f * static_cast<float>(i % 7);
    const double start = solid.elastic_energy_j(x);
    VelocityUpdate update;
    update.max_speed_m_per_s = 100;
    for (int n = 0; n < 400; ++n) {
      update_pressures(rows, false, x);
      update_velocities(rows, update, x, v);
      update_positions(static_cast<float>(k * limit), v, x);
    }
    const double grown = solid.elastic_energy_j(x) / start;
    EXPECT_EQ(k < 1, grown < 10) << k << ": " << grown;
  }
}

}  // namespace
}  // namespace sectio::tetra_test

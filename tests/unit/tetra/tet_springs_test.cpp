#include "sim_server/deformation/tetra/tet_springs.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/tet_shapes.h"
#include "tests/support/volume_settings.h"

namespace sectio::tetra_test {
namespace {

using test::at_rest;
using test::Points;
using test::still;

VolumeMaterial undamped() {
  VolumeMaterial material;
  material.damping_per_s = 0;
  return material;
}
double kinetic_j(const TetSprings& model, const Points& v) {
  double energy = 0;
  for (VertexId i = 0; i < v.size(); ++i)
    energy += 0.5 * model.mass_kg(i) * v[i].head<3>().cast<double>().squaredNorm();
  return energy;
}

TEST(C_PHY, C_PHY_2_dampers_only_take_energy_and_leave_momentum) {
  const TetMesh mesh = test::tet_box(3, 3, 3, Vec3(0.06, 0.06, 0.06));
  TetSprings model(mesh, undamped(), test::weightless(0.0005), {0.5, 0.002, true});
  Points x = at_rest(mesh), v = still(x);
  for (std::size_t i = 0; i < x.size(); ++i) v[i].x() = 0.3f * x[i].x() * (i % 2 == 0 ? 1.0f : 0.5f) + 0.02f;
  Vec3 before = Vec3::Zero(), after = Vec3::Zero();
  for (VertexId i = 0; i < x.size(); ++i) before += model.mass_kg(i) * v[i].head<3>().cast<double>();
  const double start = kinetic_j(model, v);
  double last = start;
  for (int n = 0; n < 10; ++n) {
    for (int m = 0; m < 20; ++m) model.step(x, v, {}, {});
    const double now = kinetic_j(model, v) + model.elastic_energy_j(x);
    EXPECT_LT(now, 1.001 * last);
    last = now;
  }
  for (VertexId i = 0; i < x.size(); ++i) after += model.mass_kg(i) * v[i].head<3>().cast<double>();
  EXPECT_LT((after - before).norm(), 1e-5 * before.norm());
  const double mass = 1060 * 0.06 * 0.06 * 0.06;
  EXPECT_LT(last - before.squaredNorm() / (2 * mass), 0.5 * (start - before.squaredNorm() / (2 * mass)));
}

TEST(C_PHY, C_PHY_3_second_neighbours_have_constants_of_their_own_and_save_volume) {
  const TetMesh mesh = test::tet_box(4, 4, 4, Vec3(0.08, 0.08, 0.08));
  const auto volume_pressed = [&](double share) {
    VolumeSettings settings = test::weightless(0.001);
    TetSprings model(mesh, {}, settings, {share, 0, true});
    Points x = at_rest(mesh), v = still(x);
    std::vector<PointConstraint> plates;
    for (int n = 0; n < 400; ++n) {
      plates.clear();
      for (VertexId i = 0; i < x.size(); ++i) {
        Vec3 at = mesh.vertices_body_m[i];
        if (at.z() > 0.001 && at.z() < 0.079) continue;
        at.z() *= 1 - 0.3 * std::min(1.0, n / 200.0);
        plates.push_back(hold(i, at));
      }
      std::vector<Reaction> reactions(plates.size());
      model.step(x, v, plates, reactions);
    }
    double volume = 0;
    const auto at = [&](VertexId i) -> Vec3 { return x[i].head<3>().cast<double>(); };
    for (const Tetrahedron& t : mesh.tetrahedra) volume += tet_volume_m3(at(t[0]), at(t[1]), at(t[2]), at(t[3]));
    return volume / (0.08 * 0.08 * 0.08);
  };
  EXPECT_GT(volume_pressed(0.5), volume_pressed(0.0) + 0.005);

  const TetSprings both(mesh, {}, {}, {0.5, 0, false});
  double edges = 0, second = 0;
  const auto springs = both.springs();
  for (std::size_t n = 0; n < springs.size(); ++n) {
    const auto& s = springs[n];
    (n < both.edge_count() ? edges : second) += s.stiffness_n_per_m * s.rest_length_m * s.rest_length_m;
  }
  const double ev = 6000 * 0.08 * 0.08 * 0.08;
  EXPECT_NEAR(edges, 0.5 * 6 * ev, 1e-9 * ev);
  EXPECT_NEAR(second, 0.5 * 6 * ev, 1e-9 * ev);
}

// A vertex on springs is a harmonic oscillator: the error of Verlet's method is of second order in h.
TEST(C_PHY, C_PHY_4_A_21_verlet_is_of_second_order) {
  TetMesh mesh;
  mesh.vertices_body_m = {{0, 0, 0}, {0.05, 0, 0}, {0, 0.05, 0}, {0, 0, 0.05}};
  mesh.tetrahedra = {{0, 1, 2, 3}};
  VolumeSettings settings = test::weightless(0.001);
  settings.fixed = {0, 1, 1, 1};
  // One moving vertex on three springs at right angles: x(t) = a cos(omega t) for small a, along the axis x.
  const auto end_error = [&](double h, int steps) {
    settings.step_s = h;
    TetSprings model(mesh, undamped(), settings, {0, 0, false});
    EXPECT_EQ(model.substeps(), 1);
    const double omega = std::sqrt(model.springs()[0].stiffness_n_per_m / model.mass_kg(0)), a = 1e-3;
    Points x = at_rest(mesh), v = still(x);
    x[0].x() += static_cast<float>(a);
    // v = (x - x_before) / h, of the exact solution.
    v[0].x() = static_cast<float>(a * (1 - std::cos(omega * h)) / h);
    double worst = 0;
    for (int n = 1; n <= steps; ++n) {
      model.step(x, v, {}, {});
      worst = std::max(worst, std::abs(double{x[0].x()} - a * std::cos(omega * n * h)));
    }
    return worst;
  };
  const double coarse = end_error(0.008, 20), fine = end_error(0.004, 40);
  EXPECT_GT(std::log2(coarse / fine), 1.8);
}

TEST(C_PHY, C_PHY_5_drag_takes_what_it_should) {
  const TetMesh mesh = test::tet_box(2, 2, 2, Vec3(0.05, 0.05, 0.05));
  TetSprings model(mesh, {}, test::weightless(0.001));
  Points x = at_rest(mesh), v = still(x);
  for (Vec4f& u : v) u.y() = 0.5f;
  for (int n = 0; n < 100; ++n) model.step(x, v, {}, {});
  const double left = std::pow(1 - 25 * 0.001 / model.substeps(), 100 * model.substeps());
  for (const Vec4f& u : v) EXPECT_NEAR(u.y(), 0.5 * left, 1e-4);
}

TEST(C_PHY, C_PHY_6_free_fall) {
  const TetMesh mesh = test::tet_box(2, 2, 2, Vec3(0.05, 0.05, 0.05));
  TetSprings model(mesh, undamped(), {});
  Points x = at_rest(mesh), v = still(x);
  for (int n = 0; n < 100; ++n) model.step(x, v, {}, {});
  const double t = 0.1, h = 0.001 / model.substeps();
  for (std::size_t i = 0; i < x.size(); ++i)
    EXPECT_NEAR(mesh.vertices_body_m[i].z() - double{x[i].z()}, 0.5 * 9.81 * t * (t + h), 1e-6);
}

TEST(TetSprings, the_tensile_test_at_load_makes_youngs_modulus_right_and_says_what_poisson_is) {
  TetMesh mesh = test::tet_box(6, 4, 4, Vec3(0.12, 0.08, 0.08));
  test::jitter(mesh, 0.003);
  for (const double share : {0.0, 0.5}) {
    const TetSprings model(mesh, {}, {}, {share, 0, true});
    EXPECT_NEAR(model.calibrated().mean_young_pa, 6000, 1);
    EXPECT_NEAR(model.as_made().mean_young_pa, 6000, 0.25 * 6000);
    EXPECT_GT(model.calibrated().mean_poisson, 0.05);
    EXPECT_LT(model.calibrated().mean_poisson, 0.25);
  }
}

// A bar that is pulled at both ends in the dynamic model has the modulus of the linear tensile test.
TEST(TetSprings, a_pulled_bar_has_the_modulus_asked_for) {
  const TetMesh mesh = test::tet_box(8, 3, 3, Vec3(0.16, 0.06, 0.06));
  TetSprings model(mesh, {}, test::weightless(0.001));
  Points x = at_rest(mesh), v = still(x);
  std::vector<PointConstraint> ends;
  for (VertexId i = 0; i < x.size(); ++i)
    for (const double end : {0.0, 0.16})
      if (mesh.vertices_body_m[i].x() == end) ends.push_back(hold(i, mesh.vertices_body_m[i] + Vec3(end * 0.01, 0, 0)));
  std::vector<Reaction> reactions(ends.size());
  for (int n = 0; n < 800; ++n) model.step(x, v, ends, reactions);
  double pull = 0;
  for (std::size_t n = 0; n < ends.size(); ++n)
    if (ends[n].target_world_m.x() < 0.001) pull += reactions[n].force_on_tool_n.x();
  EXPECT_NEAR(pull / (0.06 * 0.06) / 0.01, 6000, 0.16 * 6000);  // its ends are clamped
}

}  // namespace
}  // namespace sectio::tetra_test

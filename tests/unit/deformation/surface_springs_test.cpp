// The model as a body: rest, gravity, energy and calibration (paper B, 2.1).
#include <gtest/gtest.h>

#include <set>

#include "tests/support/random.h"
#include "tests/unit/deformation/shapes.h"

namespace sectio::deformation_test {
namespace {

using test::Particles;

TEST(B_MSM, B_MSM_1_every_edge_is_a_spring_every_vertex_has_a_home_and_damping_follows_velocity) {
  const TriangleMesh mesh = test::organ(2);
  const SurfaceSprings springs(mesh, {}, {}, test::no_gravity());
  std::set<std::pair<VertexId, VertexId>> edges;
  for (const Triangle& t : mesh.triangles()) {
    for (std::size_t i = 0; i < 3; ++i) edges.insert({t.v[i], t.v[(i + 1) % 3]});
  }
  std::set<std::pair<VertexId, VertexId>> half_edges;
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    EXPECT_GT(springs.rows().row(v).k_home, 0);
    for (std::uint32_t n = 0; n < springs.rows().degree(v); ++n) {
      EXPECT_GT(springs.rows().half_edge(v, n).k, 0);
      half_edges.insert({v, springs.rows().half_edge(v, n).to});
    }
  }
  EXPECT_EQ(half_edges, edges);  // both directions of each edge are among the directed edges of a closed surface

  for (const double alpha : {0.0, 10.0, 40.0}) {
    SurfaceSpringMaterial material;
    material.damping_per_s = alpha;
    SurfaceSprings damped(mesh, {}, material, test::no_gravity());
    SurfaceSprings still(mesh, {}, material, test::no_gravity());
    Particles p(mesh, {}), q(mesh, {});
    p.v[3].x() = 0.2f;
    damped.step(p.x, p.v);
    still.step(q.x, q.v);
    EXPECT_NEAR(p.v[3].x() - q.v[3].x(), 0.2 * (1 - alpha * 0.001), 1e-6) << alpha;
  }
}

TEST(B_MSM, B_MSM_2_settles_under_gravity_without_support_and_keeps_its_volume) {
  const TriangleMesh mesh = test::organ();
  const double k_w = 2 * 6000 / (1 - 0.45 * 0.45) / (M_PI * 0.008);
  for (const double given : {1.0, 0.0}) {  // share of the gravity in which the shape was given
    SurfaceSpringSettings settings;
    settings.given_gravity_m_per_s2 = given * settings.gravity_m_per_s2;
    SurfaceSprings springs(mesh, {}, {}, settings);
    Particles p(mesh, {});
    const double volume = test::volume_m3(mesh, p);
    p.run(springs, 2000);
    EXPECT_LT(p.speed(), 1e-5);
    EXPECT_NEAR(test::volume_m3(mesh, p) / volume, 1, 0.002);
    double sag = 0;
    for (VertexId v = 0; v < mesh.vertex_slots(); ++v) sag -= (p.at(v) - mesh.rest_body_m(v)).z();
    sag /= mesh.vertex_count();
    // rho g a_ref / K_w
    EXPECT_NEAR(sag, (1 - given) * 1060 * 9.81 * 0.008 / k_w, 2e-6);
    EXPECT_EQ(springs.clamped(), 0u);
  }
}

TEST(B_MSM, B_MSM_2_control_collapses_without_home_springs) {
  const TriangleMesh mesh = test::organ();
  SurfaceSpringMaterial material;
  material.home_springs = false;
  SurfaceSpringSettings settings;
  settings.fixed = [](const Vec3& home) { return home.z() < -0.02; };  // lies on something
  SurfaceSprings springs(mesh, {}, material, settings);
  Particles p(mesh, {});
  const double volume = test::volume_m3(mesh, p);
  p.run(springs, 2000);
  EXPECT_LT(test::volume_m3(mesh, p) / volume, 0.7);

  material.home_springs = true;
  SurfaceSprings kept(mesh, {}, material, settings);
  Particles q(mesh, {});
  q.run(kept, 2000);
  EXPECT_NEAR(test::volume_m3(mesh, q) / volume, 1, 0.02);
}

// The indentation of the top by a weight of 0.5 N on the nearest vertices.
double dent_m(const SurfaceSpringMaterial& material) {
  const TriangleMesh mesh = test::organ();
  SurfaceSprings springs(mesh, {}, material, test::no_gravity(0.0005));
  Particles p(mesh, {});
  p.run(springs, 2000);
  VertexId top = 0;
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v)
    top = mesh.rest_body_m(v).z() > mesh.rest_body_m(top).z() ? v : top;
  const double before = p.at(top).z();
  for (int n = 0; n < 2000; ++n) {
    springs.add_force(top, Vec3(0, 0, -0.05));
    springs.step(p.x, p.v);
  }
  return before - p.at(top).z();
}

TEST(B_MSM, B_MSM_4_constants_tune_the_material_monotonically) {
  const auto rises = [](auto set, std::initializer_list<double> values, double sign) {
    double last = -1e9;
    for (const double value : values) {
      SurfaceSpringMaterial material;
      set(material, value);
      const double dent = sign * dent_m(material);
      EXPECT_GT(dent, last + 1e-6) << value;
      last = dent;
    }
  };
  rises([](SurfaceSpringMaterial& m, double x) { m.young_pa = x; }, {3000, 6000, 12000, 24000}, -1);
  rises([](SurfaceSpringMaterial& m, double x) { m.skin_thickness_m = x; }, {0.001, 0.002, 0.004}, -1);
  rises([](SurfaceSpringMaterial& m, double x) { m.foundation_radius_m = x; }, {0.004, 0.008, 0.016}, 1);
  rises([](SurfaceSpringMaterial& m, double x) { m.pretension = x; }, {0.0, 0.06, 0.2}, -1);
}

// A flat membrane pulled in its plane: the net has E_2D = E t within 20 %. (On a
// sphere: a uniform stretch s of the net gives energy k s^2 l^2 / 2 summed, to compare with E_2D s^2 / (1 - nu) A.)
TEST(SurfaceSprings, membrane_stiffness_comes_from_young_modulus) {
  const TriangleMesh mesh = test::organ();
  SurfaceSpringMaterial material;
  material.pretension = 0;
  material.home_springs = false;
  const SurfaceSprings springs(mesh, {}, material, test::no_gravity());
  Particles p(mesh, {});
  const double stretch = 0.01;
  for (Vec4f& x : p.x) x *= static_cast<float>(1 + stretch);
  double area = 0;
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) area += springs.mass_kg(v) / (1060 * 0.008);
  const double expected = 6000 * 0.002 * stretch * stretch / (1 - 1.0 / 3) * area;
  EXPECT_NEAR(springs.energy_j(p.x, p.v) / expected, 1, 0.02);
}

TEST(SurfaceSprings, energy_only_falls_without_input) {
  const TriangleMesh mesh = test::organ();
  SurfaceSprings springs(mesh, {}, {}, {});
  Particles p(mesh, {});
  test::Random random(3);
  std::uniform_real_distribution<float> unit(-0.05f, 0.05f);
  for (Vec4f& v : p.v) v.head<3>() = Vec3f(unit(random), unit(random), unit(random));
  double last = springs.energy_j(p.x, p.v);
  const double first = last;
  for (int n = 0; n < 60; ++n) {
    p.run(springs, 25);  // over a few periods of the fastest wave: symplectic Euler's energy ripples within one
    const double now = springs.energy_j(p.x, p.v);
    EXPECT_LT(now, last + 1e-9);
    last = now;
  }
  EXPECT_LT(last, first);
}

TEST(SurfaceSprings, fixed_vertices_stay) {
  const TriangleMesh mesh = test::organ(2);
  SurfaceSpringSettings settings;
  settings.fixed = [](const Vec3& home) { return home.x() > 0.03; };
  SurfaceSprings springs(mesh, {}, {}, settings);
  Particles p(mesh, {});
  p.run(springs, 300);
  int fixed = 0;
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    if (!springs.fixed(v)) continue;
    ++fixed;
    EXPECT_EQ(p.x[v].head<3>(), mesh.rest_body_m(v).cast<float>());
  }
  EXPECT_GT(fixed, 5);
}

TEST(SurfaceSprings, a_pose_moves_the_body_and_changes_nothing_else) {
  const TriangleMesh mesh = test::organ(2);
  Pose pose;
  pose.position_m = Vec3(0.1, -0.05, 0.02);
  pose.orientation = Eigen::AngleAxisd(1.1, Vec3(1, 2, 3).normalized());
  SurfaceSprings here(mesh, {}, {}, test::no_gravity()), there(mesh, pose, {}, test::no_gravity());
  Particles p(mesh, {}), q(mesh, pose);
  p.run(here, 500);
  q.run(there, 500);
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) EXPECT_LT((pose.to_world(p.at(v)) - q.at(v)).norm(), 1e-6);
}

TEST(SurfaceSprings, two_runs_give_the_same_bits) {
  const TriangleMesh mesh = test::organ(2);
  SurfaceSprings a(mesh, {}, {}, {}), b(mesh, {}, {}, {});
  Particles p(mesh, {}), q(mesh, {});
  p.run(a, 200);
  q.run(b, 200);
  EXPECT_EQ(p.x, q.x);
  EXPECT_EQ(p.v, q.v);
}

}  // namespace
}  // namespace sectio::deformation_test

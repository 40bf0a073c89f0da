// A long free motion: what must stay stays.
#include <gtest/gtest.h>

#include "sim_server/deformation/tetra/tet_solid.h"
#include "tests/support/tet_shapes.h"

namespace sectio {
namespace {

TEST(A_accuracy, A_18_a_stretched_body_spins_for_five_seconds) {
  const TetMesh mesh = test::tet_box(4, 2, 2, Vec3(0.1, 0.05, 0.05));
  VolumeMaterial material;
  material.damping_per_s = 0;
  VolumeSettings settings;
  settings.step_s = 0.0005;
  settings.gravity_m_per_s2.setZero();
  TetSolid solid(mesh, material, settings);
  std::vector<Vec4f> x(mesh.vertices_body_m.size(), Vec4f::Zero()), v = x;
  for (std::size_t i = 0; i < x.size(); ++i) {
    x[i].head<3>() = (1.05 * (mesh.vertices_body_m[i] - Vec3(0.05, 0.025, 0.025))).cast<float>();
    v[i].head<3>() = Vec3f(1, 2, 3).cross(x[i].head<3>());
  }
  struct Sum {
    Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
    double energy = 0, speed = 0;
  };
  const auto sum = [&] {
    Sum s;
    s.energy = solid.elastic_energy_j(x);
    for (VertexId i = 0; i < x.size(); ++i) {
      const Vec3 p = solid.mass_kg(i) * v[i].head<3>().cast<double>();
      s.linear += p;
      s.speed += p.norm();
      s.angular += x[i].head<3>().cast<double>().cross(p);
      s.energy += 0.5 * p.dot(v[i].head<3>().cast<double>());
    }
    return s;
  };
  const auto mean_energy = [&](int steps) {
    double mean = 0;
    for (int n = 0; n < steps; ++n) {
      solid.step(x, v, {}, {});
      mean += sum().energy / steps;
    }
    return mean;
  };
  const Sum start = sum();
  const double first = mean_energy(500);
  for (int n = 0; n < 9000; ++n) solid.step(x, v, {}, {});
  const double last = mean_energy(500);
  const Sum end = sum();
  EXPECT_LT((end.linear - start.linear).norm(), 5e-6 * start.speed);
  EXPECT_LT((end.angular - start.angular).norm(), 2e-4 * start.angular.norm());
  EXPECT_NEAR(last, first, 2e-3 * first);
  EXPECT_EQ(solid.implicit_steps(), 0u);
}

}  // namespace
}  // namespace sectio

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

// A regular tetrahedron that swells and shrinks: by symmetry one mode, an oscillator.
struct Breathing {
  TetMesh mesh{{Vec3(1, 1, 1), Vec3(1, -1, -1), Vec3(-1, 1, -1), Vec3(-1, -1, 1)}, {{0, 1, 2, 3}}};
  VolumeMaterial material;
  VolumeSettings settings;
  std::vector<Vec4f> x, v;

  explicit Breathing(double damping_per_s, double step_s) {
    for (Vec3& p : mesh.vertices_body_m) p *= 0.05;
    if (tet_volume_m3(mesh, mesh.tetrahedra[0]) < 0) std::swap(mesh.tetrahedra[0][2], mesh.tetrahedra[0][3]);
    material.damping_per_s = damping_per_s;
    settings.gravity_m_per_s2.setZero();
    settings.step_s = step_s;
    x = test::at_rest(mesh);
    v = test::still(x);
    for (Vec4f& p : x) p.head<3>() *= 1.01f;
  }
  double strain() const { return x[0].head<3>().cast<double>().norm() / mesh.vertices_body_m[0].norm() - 1; }
  // From the force at a small strain.
  double omega() const {
    const TetSolid solid(mesh, material, settings);
    std::vector<Vec4f> at = test::at_rest(mesh);
    for (Vec4f& p : at) p.head<3>() *= 1.001f;
    std::vector<Vec3> force(4);
    solid.elastic_forces_n(at, force);
    return std::sqrt(force[0].norm() / (solid.mass_kg(0) * 0.001 * mesh.vertices_body_m[0].norm()));
  }
};

// e = exp(-pi zeta / sqrt(1 - zeta^2)) after the half period pi / (omega sqrt(1 - zeta^2))
TEST(A_accuracy, A_19_a_damped_bounce) {
  const double omega = Breathing(0, 1e-4).omega();
  for (const double zeta : {0.02, 0.1, 0.3}) {
    const double step_s = 0.002 / omega;
    Breathing body(2 * zeta * omega, step_s);
    TetSolid solid(body.mesh, body.material, body.settings);
    double least = 0, at_s = 0;
    for (int n = 1; n * step_s * omega < 5; ++n) {
      solid.step(body.x, body.v, {}, {});
      if (body.strain() < least) least = body.strain(), at_s = n * step_s;
    }
    const double root = std::sqrt(1 - zeta * zeta);
    EXPECT_NEAR(-least / 0.01, std::exp(-M_PI * zeta / root), 0.03) << zeta;
    EXPECT_NEAR(at_s * omega, M_PI / root, 0.03 * M_PI) << zeta;
  }
}

// x at the end of a short motion, for steps h, h / 2, h / 4. Symplectic Euler is of first order; begun with the
// velocity of half a step before, it is Verlet's, of second order.
double observed_order(bool with_half_step) {
  const double omega = Breathing(0, 1e-4).omega();
  double strain[3];
  for (int k = 0; k < 3; ++k) {
    const int steps = 20 << k;
    Breathing body(0, 2.0 / omega / steps);
    TetSolid solid(body.mesh, body.material, body.settings);
    EXPECT_EQ(solid.parts(), 1);
    std::vector<Vec3> force(4);
    solid.elastic_forces_n(body.x, force);
    for (VertexId i = 0; i < 4 && with_half_step; ++i)
      body.v[i].head<3>() = (-0.5 * body.settings.step_s / solid.mass_kg(i) * force[i]).cast<float>();
    for (int n = 0; n < steps; ++n) solid.step(body.x, body.v, {}, {});
    strain[k] = body.strain();
  }
  return std::log2(std::abs((strain[0] - strain[1]) / (strain[1] - strain[2])));
}

TEST(A_accuracy, A_21_orders_in_time) {
  EXPECT_GT(observed_order(false), 0.9);
  EXPECT_GT(observed_order(true), 1.9);
}

// Implicit Euler: each step divides the amplitude by sqrt(1 + omega^2 h^2), a damping ratio of omega h / 2.
TEST(A_accuracy, A_21_the_implicit_driver_damps_by_half_the_step) {
  for (const double omega_h : {0.05, 0.1, 0.2}) {
    const double omega = Breathing(0, 1e-4).omega(), step_s = omega_h / omega;
    Breathing body(0, step_s);
    TetSolid solid(body.mesh, body.material, body.settings, TetDriver::implicit_only);
    const auto energy = [&] {
      double sum = solid.elastic_energy_j(body.x);
      for (VertexId i = 0; i < 4; ++i) sum += 0.5 * solid.mass_kg(i) * double{body.v[i].squaredNorm()};
      return sum;
    };
    const double before = energy();
    const int steps = static_cast<int>(std::lround(2 * M_PI / omega_h));  // a period
    for (int n = 0; n < steps; ++n) solid.implicit_step(body.x, body.v, step_s, 400);
    const double zeta = -std::log(energy() / before) / (2 * steps * omega_h);
    EXPECT_NEAR(zeta / (omega_h / 2), 1, 0.05) << omega_h;
  }
}

}  // namespace
}  // namespace sectio

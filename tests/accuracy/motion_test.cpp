// Free motion: what must stay stays, and what time steps leave falls as it should. Every volume model.
#include <gtest/gtest.h>

#include <complex>

#include "sim_server/deformation/surface_springs.h"
#include "sim_server/deformation/tetra/tet_solid.h"
#include "sim_server/volume/tets/tet_cut.h"
#include "tests/support/moving_body.h"
#include "tests/support/shapes.h"
#include "tests/support/volume_settings.h"

namespace sectio::motion_test {
namespace {

using test::MovingBody;
using test::MovingModel;
using test::Points;

class Motion : public ::testing::TestWithParam<MovingModel> {};
INSTANTIATE_TEST_SUITE_P(models, Motion,
                         ::testing::Values(test::moving_springs(), test::moving_tetrahedra(), test::moving_hexahedra()),
                         [](const auto& at) { return std::string(at.param.name); });

VolumeMaterial damped(double damping_per_s) {
  VolumeMaterial material;
  material.damping_per_s = damping_per_s;
  return material;
}

struct Sum {
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
  double speed = 0;
};
Sum momentum(const MovingBody& body) {
  Sum sum;
  for (const test::Particle& at : body.particles()) {
    const Vec3 p = at.mass_kg * at.v_m_per_s;
    sum.linear += p;
    sum.speed += p.norm();
    sum.angular += at.x_m.cross(p);
  }
  return sum;
}

// Stretched by 5 % and spinning about its middle, in cubes of 25 mm.
MovingBody spinning(const MovingModel& model, double step_s) {
  MovingBody body =
      model.make(test::tet_box(4, 2, 2, Vec3(0.1, 0.05, 0.05)), 0.025, damped(0), test::weightless(step_s));
  for (VertexId i = 0; i < body.x.size(); ++i) {
    body.x[i].head<3>() = (1.05 * (body.mesh.vertices_body_m[i] - Vec3(0.05, 0.025, 0.025))).cast<float>();
    body.v[i].head<3>() = Vec3f(1, 2, 3).cross(body.x[i].head<3>());
  }
  return body;
}

TEST_P(Motion, A_18_a_stretched_body_spins_for_five_seconds) {
  MovingBody body = spinning(GetParam(), 0.0005);
  body.step();
  const auto mean_energy = [&](int steps) {
    double mean = 0;
    for (int n = 0; n < steps; ++n) {
      body.step();
      mean += body.energy_j() / steps;
    }
    return mean;
  };
  const Sum start = momentum(body);
  const double first = mean_energy(1000);
  body.step(8000);
  const double last = mean_energy(1000);
  const Sum end = momentum(body);
  EXPECT_LT((end.linear - start.linear).norm(), 5e-6 * start.speed);
  EXPECT_LT((end.angular - start.angular).norm(), 2e-4 * start.angular.norm());
  EXPECT_NEAR(last, first, 2e-3 * first);
  EXPECT_EQ(body.parts.model->diagnostics().implicit_steps, 0u);
}

// x = g t^2 / 2, and half a step more, which symplectic Euler falls ahead.
TEST_P(Motion, A_19_free_fall) {
  VolumeSettings settings;
  settings.step_s = 2e-4;
  MovingBody body = GetParam().make(test::tet_box(2, 2, 2, Vec3::Constant(0.05)), 0.025, damped(0), settings);
  body.step(500);
  for (std::size_t i = 0; i < body.x.size(); ++i)
    EXPECT_NEAR(body.mesh.vertices_body_m[i].z() - double{body.x[i].z()}, 0.5 * 9.81 * 0.01, 1.1e-4) << i;
}

// surface_springs has no other free motion: home springs hold an anchored body, and the frame of a free piece follows
// it.
TEST(Accuracy, A_19_a_free_piece_of_surface_springs_falls) {
  const TriangleMesh mesh(test::ellipsoid(1, Vec3(0.02, 0.02, 0.02)));
  SurfaceSpringMaterial material;
  material.damping_per_s = 0;
  material.pretension = 0;
  SurfaceSpringSettings settings;
  settings.step_s = 2e-4;
  SurfaceSprings springs(mesh, {}, material, settings);
  std::vector<VertexId> all;
  Points x;
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    all.push_back(v);
    x.push_back(Vec4f::Zero());
    x.back().head<3>() = mesh.rest_body_m(v).cast<float>();
  }
  Points velocity = test::still(x);
  springs.release(all, {});
  for (int n = 0; n < 500; ++n) springs.step(x, velocity);
  for (const VertexId v : all) EXPECT_NEAR(mesh.rest_body_m(v).z() - double{x[v].z()}, 0.5 * 9.81 * 0.01, 1.1e-4);
}

// A body that swells and shrinks in one form, an oscillator by symmetry: a regular tetrahedron, or one cell.
struct Breathing {
  MovingBody body;
  double omega;
  double strain() const { return body.x[0].head<3>().cast<double>().norm() / body.mesh.vertices_body_m[0].norm() - 1; }
};
Breathing breathing(const MovingModel& model, double damping_per_s, double step_s, float stretch = 1.01f) {
  const bool cell = std::string(model.name) == "neo_hookean_lattice";
  TetMesh mesh{{Vec3(1, 1, 1), Vec3(1, -1, -1), Vec3(-1, 1, -1), Vec3(-1, -1, 1)}, {{0, 1, 2, 3}}};
  if (cell) mesh = test::tet_box(1, 1, 1, Vec3::Constant(2));
  for (Vec3& p : mesh.vertices_body_m) p = 0.05 * (cell ? Vec3(p - Vec3::Ones()) : p);
  for (Tetrahedron& t : mesh.tetrahedra)
    if (tet_volume_m3(mesh, t) < 0) std::swap(t[2], t[3]);
  Breathing b{model.make(mesh, 0.1, damped(damping_per_s), test::weightless(step_s)), 0};
  // From the force at a small strain.
  Points at = b.body.parts.rest;
  const double radius = at[0].head<3>().cast<double>().norm(), mass = b.body.particles()[0].mass_kg;
  for (Vec4f& p : at) p.head<3>() *= 1.001f;
  std::vector<Vec3> force(at.size());
  b.body.parts.elastic_forces_n(at, force);
  b.omega = std::sqrt(force[0].norm() / (mass * 0.001 * radius));
  for (Vec4f& p : b.body.x) p.head<3>() *= stretch;
  return b;
}

// e = exp(-pi zeta / sqrt(1 - zeta^2)) after the half period pi / (omega sqrt(1 - zeta^2))
TEST_P(Motion, A_19_a_damped_bounce) {
  const double omega = breathing(GetParam(), 0, 1e-4).omega;
  for (const double zeta : {0.02, 0.1, 0.3}) {
    const double step_s = 0.002 / omega;
    Breathing b = breathing(GetParam(), 2 * zeta * omega, step_s);
    double least = 0, at_s = 0;
    for (int n = 1; n * step_s * omega < 5; ++n) {
      b.body.step();
      if (b.strain() < least) least = b.strain(), at_s = n * step_s;
    }
    const double root = std::sqrt(1 - zeta * zeta);
    EXPECT_NEAR(-least / 0.01, std::exp(-M_PI * zeta / root), 0.03) << zeta;
    EXPECT_NEAR(at_s * omega, M_PI / root, 0.03 * M_PI) << zeta;
  }
}

// A body that is stretched evenly and spins is cut through. Momentum stays, and the elastic energy of elements; a net
// of springs has other springs then.
TEST_P(Motion, A_20_a_cut_leaves_energy_and_momentum_as_they_were) {
  MovingBody body = spinning(GetParam(), 1e-7);
  body.step();
  TetTopology volume(body.mesh);
  for (VertexId v = 0; v < body.x.size(); ++v)
    volume.set_state(v, body.x[v].head<3>().cast<double>(), body.v[v].head<3>().cast<double>());
  const Sum before = momentum(body);
  const auto elastic_j = [&] { return body.parts.model->energy_j(body.x, test::still(body.x)); };
  const double energy_j = elastic_j();
  EXPECT_GT(cut(volume, {{Vec3(0.011, -1, -1), Vec3(0.013, 1, -1), Vec3(0.013, 1, 1), Vec3(0.011, -1, 1)}}, {}).twins,
            4u);
  for (VertexId v = static_cast<VertexId>(body.x.size()); v < volume.vertex_count(); ++v)
    for (auto* of : {&body.x, &body.v}) of->push_back(Vec4f::Zero());
  for (VertexId v = 0; v < body.x.size(); ++v) {
    body.x[v].head<3>() = volume.vertex(v).position_world_m.cast<float>();
    body.v[v].head<3>() = volume.vertex(v).velocity_m_per_s.cast<float>();
  }
  body.parts.model->change(volume.change());
  body.step();
  const Sum after = momentum(body);
  EXPECT_LT((after.linear - before.linear).norm(), 1e-6 * before.speed);
  const bool springs = std::string(GetParam().name) == "tetra_springs";
  EXPECT_NEAR(elastic_j(), energy_j, (springs ? 0.1 : 1e-5) * energy_j);
}

// x at the end of a short motion, for steps h, h / 2, h / 4. Symplectic Euler is of first order; begun with the
// velocity of half a step before, it is Verlet's, of second order.
double observed_order(const MovingModel& model, bool with_half_step) {
  const double omega = breathing(model, 0, 1e-4).omega;
  constexpr float kStretch = 1.1f;  // far above what single precision leaves
  double strain[3];
  for (int k = 0; k < 3; ++k) {
    const int steps = 20 << k;
    const double step_s = 2.0 / omega / steps;
    Breathing b = breathing(model, 0, step_s, kStretch);
    // The force is along the radius and the same at every vertex.
    Points at = b.body.parts.rest;
    for (Vec4f& p : at) p.head<3>() *= kStretch;
    std::vector<Vec3> force(at.size());
    b.body.parts.elastic_forces_n(at, force);
    const double speed = 0.5 * step_s / b.body.particles()[0].mass_kg * force[0].norm();
    for (VertexId i = 0; i < b.body.x.size() && with_half_step; ++i)
      b.body.v[i].head<3>() = (speed * b.body.mesh.vertices_body_m[i].normalized()).cast<float>();
    b.body.step(steps);
    strain[k] = b.strain();
  }
  return std::log2(std::abs((strain[0] - strain[1]) / (strain[1] - strain[2])));
}

TEST_P(Motion, A_21_orders_in_time) {
  EXPECT_GT(observed_order(GetParam(), false), 0.9);
  EXPECT_GT(observed_order(GetParam(), true), 1.9);
}

// BDF2: a step multiplies the amplitude by (2 + sqrt(1 + 2 i omega h)) / (3 - 2 i omega h), a damping ratio of about
// (omega h)^3 / 4, where backward Euler has omega h / 2. The first step is one of backward Euler.
TEST(Accuracy, A_21_the_implicit_driver_damps_by_less_than_a_tenth_of_backward_euler) {
  const MovingModel model = test::moving_tetrahedra();
  const double omega = breathing(model, 0, 1e-4).omega;
  for (const double omega_h : {0.05, 0.1, 0.2}) {
    const double step_s = omega_h / omega;
    Breathing b = breathing(model, 0, step_s);
    TetSolid solid(b.body.mesh, damped(0), test::weightless(step_s), VolumeIntegrator::implicit_only);
    solid.step(b.body.x, b.body.v, {}, {});
    const double before = solid.energy_j(b.body.x, b.body.v);
    const int steps = static_cast<int>(std::lround(2 * M_PI / omega_h));  // a period
    for (int n = 0; n < steps; ++n) solid.step(b.body.x, b.body.v, {}, {});
    const double zeta = -std::log(solid.energy_j(b.body.x, b.body.v) / before) / (2 * steps * omega_h);
    const std::complex<double> two_ih(0, 2 * omega_h), growth = (2.0 + std::sqrt(1.0 + two_ih)) / (3.0 - two_ih);
    EXPECT_NEAR(zeta, -std::log(std::abs(growth)) / omega_h, 0.1 * omega_h / 2) << omega_h;
  }
}

}  // namespace
}  // namespace sectio::motion_test

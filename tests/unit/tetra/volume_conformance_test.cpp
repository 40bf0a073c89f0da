// One suite for every deformation engine: the force is minus the gradient of the energy, the stiffness is symmetric and
// the linear one at rest, linear and angular momentum are conserved, the rest shape has no forces, and rigid motion
// changes neither energy nor forces.
#include <gtest/gtest.h>

#include <cmath>

#include "sim_server/deformation/hexa/hex_solid.h"
#include "sim_server/deformation/surface_springs.h"
#include "sim_server/deformation/tetra/tet_solid.h"
#include "sim_server/deformation/tetra/tet_springs.h"
#include "tests/support/shapes.h"
#include "tests/support/tet_shapes.h"

namespace sectio::tetra_test {
namespace {

using Points = std::vector<Vec4f>;

// Forces and energy of a model, on a body about 0.1 m across.
struct Engine {
  Points rest;
  std::function<double(const Points&)> energy_j;
  std::function<std::vector<Vec3>(const Points&)> forces_n;
  double force_scale_n;  // E A of the body: the force at a strain of 1
};

Points points(std::span<const Vec3> at) {
  Points p(at.size(), Vec4f::Zero());
  for (std::size_t i = 0; i < at.size(); ++i) p[i].head<3>() = at[i].cast<float>();
  return p;
}

TetMesh jittered_block() {
  TetMesh mesh = test::tet_box(4, 3, 3, Vec3(0.08, 0.06, 0.06));
  test::jitter(mesh, 0.003);
  return mesh;
}

template <class Model>
Engine volume_engine(std::shared_ptr<Model> model, std::span<const Vec3> rest_m) {
  return {points(rest_m), [model](const Points& x) { return model->elastic_energy_j(x); },
          [model](const Points& x) {
            std::vector<Vec3> f(x.size());
            model->elastic_forces_n(x, f);
            return f;
          },
          6000 * 0.06 * 0.06};
}

Engine solid_engine(const VolumeMaterial& material) {
  const TetMesh mesh = jittered_block();
  return volume_engine(std::make_shared<TetSolid>(mesh, material, VolumeSettings{}), mesh.vertices_body_m);
}

Engine layered_engine() {
  VolumeMaterial layered;
  const std::size_t tetrahedra = jittered_block().tetrahedra.size();
  for (std::size_t t = 0; t < tetrahedra; ++t) layered.stiffness_factor.push_back(t % 3 == 0 ? 5 : 1);
  return solid_engine(layered);
}

Engine springs_engine(double second_share) {
  const TetMesh mesh = jittered_block();
  return volume_engine(
      std::make_shared<TetSprings>(mesh, VolumeMaterial{}, VolumeSettings{}, TetSpringOptions{second_share, 0, true}),
      mesh.vertices_body_m);
}

Engine surface_engine() {
  const auto mesh = std::make_shared<TriangleMesh>(test::ellipsoid(2, Vec3(0.05, 0.04, 0.03)));
  SurfaceSpringMaterial material;
  material.home_springs = false;
  material.pretension = 0;
  material.damping_per_s = 0;
  SurfaceSpringSettings settings;
  settings.gravity_m_per_s2.setZero();
  settings.step_s = 1e-6;
  const auto springs = std::make_shared<SurfaceSprings>(*mesh, Pose{}, material, settings);
  return {points(mesh->rest_body_m()),
          [springs](const Points& x) { return springs->energy_j(x, Points(x.size(), Vec4f::Zero())); },
          [springs](const Points& x) {
            Points at = x, v(x.size(), Vec4f::Zero());
            springs->step(at, v);
            std::vector<Vec3> f;
            for (VertexId i = 0; i < v.size(); ++i)
              f.push_back(springs->mass_kg(i) / 1e-6 * v[i].head<3>().cast<double>());
            return f;
          },
          6000 * 0.002 * 0.08};
}

// The lattice, on its nodes; cells at the border are partly empty.
Engine lattice_engine(const VolumeMaterial& material) {
  const TetMesh mesh = jittered_block();
  const auto solid = std::make_shared<HexSolid>(mesh, grid_around(mesh, 0.017), material, VolumeSettings{});
  std::vector<Vec3> nodes;
  for (std::uint32_t n = 0; n < solid->lattice().nodes.size(); ++n) nodes.push_back(solid->lattice().rest_m(n));
  return volume_engine(solid, nodes);
}

// Made by the test that needs it: the program starts anew for each of its cases.
struct NamedEngine {
  std::string name;
  std::function<Engine()> make;
};

std::vector<NamedEngine> engines() {
  std::vector<NamedEngine> all{{"neo_hookean layered", layered_engine}, {"surface_springs", surface_engine}};
  for (const double poisson : {0.3, 0.45, 0.49}) {
    VolumeMaterial material;
    material.poisson = poisson;
    all.push_back({"neo_hookean " + std::to_string(poisson), [material] { return solid_engine(material); }});
    all.push_back({"lattice " + std::to_string(poisson), [material] { return lattice_engine(material); }});
  }
  for (const double share : {0.0, 0.5})
    all.push_back({"springs " + std::to_string(share), [share] { return springs_engine(share); }});
  return all;
}

// A deformation that stretches, shears and bends by some tenths.
Points deformed(const Points& rest) {
  Points x = rest;
  for (Vec4f& p : x) {
    const Vec3f r = p.head<3>();
    p.head<3>() = Vec3f(1.2f * r.x() + 0.2f * r.y() + 3 * r.z() * r.z(), 0.9f * r.y() + 2 * r.x() * r.z(),
                        1.05f * r.z() - 0.15f * r.x() + 2 * r.x() * r.y());
  }
  return x;
}

double norm(const std::vector<Vec3>& f) {
  double sum = 0;
  for (const Vec3& v : f) sum += v.squaredNorm();
  return std::sqrt(sum);
}

class EveryEngine : public ::testing::TestWithParam<NamedEngine> {};

TEST_P(EveryEngine, force_is_minus_the_gradient_of_the_energy) {
  const Engine engine = GetParam().make();
  const Points x = deformed(engine.rest);
  const std::vector<Vec3> f = engine.forces_n(x);
  const double typical = norm(f) / std::sqrt(static_cast<double>(f.size()));
  for (std::size_t v = 0; v < x.size(); v += 7)
    for (int k = 0; k < 3; ++k) {
      Points a = x, b = x;
      a[v][k] -= 1e-4f;
      b[v][k] += 1e-4f;
      const double by = double{b[v][k]} - double{a[v][k]};
      EXPECT_NEAR(-(engine.energy_j(b) - engine.energy_j(a)) / by, f[v][k], 2e-3 * typical) << v << " " << k;
    }
}

TEST_P(EveryEngine, stiffness_is_symmetric_and_holds_at_rest) {
  const Engine engine = GetParam().make();
  const auto stiffness_times = [&](const std::vector<Vec3>& u) {
    Points a = engine.rest, b = engine.rest;
    for (std::size_t i = 0; i < u.size(); ++i) {
      a[i].head<3>() -= (2e-4 * u[i]).cast<float>();
      b[i].head<3>() += (2e-4 * u[i]).cast<float>();
    }
    const std::vector<Vec3> fa = engine.forces_n(a), fb = engine.forces_n(b);
    std::vector<Vec3> ku(u.size());
    for (std::size_t i = 0; i < u.size(); ++i) ku[i] = (fa[i] - fb[i]) / 4e-4;
    return ku;
  };
  const std::size_t n = engine.rest.size();
  std::vector<Vec3> u(n), w(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double s = static_cast<double>(i);
    u[i] = Vec3(std::sin(3 * s), std::sin(5 * s + 1), std::sin(7 * s + 2));
    w[i] = Vec3(std::sin(4 * s + 3), std::sin(6 * s), std::sin(2 * s + 1));
  }
  const std::vector<Vec3> ku = stiffness_times(u), kw = stiffness_times(w);
  double wku = 0, ukw = 0, uku = 0;
  for (std::size_t i = 0; i < n; ++i) wku += w[i].dot(ku[i]), ukw += u[i].dot(kw[i]), uku += u[i].dot(ku[i]);
  EXPECT_GT(uku, 0);
  EXPECT_NEAR(wku, ukw, 1e-3 * uku);
}

TEST_P(EveryEngine, nothing_pulls_at_rest_wherever_that_is) {
  const Engine engine = GetParam().make();
  const Eigen::Quaternionf turn(Eigen::AngleAxisf(0.7f, Vec3f(1, 2, -1).normalized()));
  for (const bool moved : {false, true}) {
    Points x = engine.rest;
    if (moved)
      for (Vec4f& p : x) p.head<3>() = turn * p.head<3>() + Vec3f(0.1f, -0.05f, 0.08f);
    for (const Vec3& f : engine.forces_n(x)) EXPECT_LT(f.norm(), 1e-5 * engine.force_scale_n);
    EXPECT_LT(engine.energy_j(x), 1e-9 * engine.force_scale_n);
  }
}

TEST_P(EveryEngine, C_PHY_1_forces_add_up_to_nothing_and_so_do_their_moments) {
  const Engine engine = GetParam().make();
  const Points x = deformed(engine.rest);
  const std::vector<Vec3> f = engine.forces_n(x);
  Vec3 sum = Vec3::Zero(), moment = Vec3::Zero();
  for (std::size_t i = 0; i < f.size(); ++i) {
    sum += f[i];
    moment += x[i].head<3>().cast<double>().cross(f[i]);
  }
  EXPECT_LT(sum.norm(), 2e-6 * norm(f));
  EXPECT_LT(moment.norm(), 2e-7 * norm(f));
}

TEST_P(EveryEngine, rigid_motion_turns_the_forces_and_keeps_the_energy) {
  const Engine engine = GetParam().make();
  const Points x = deformed(engine.rest);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(1.1, Vec3(-1, 1, 2).normalized()));
  Points moved = x;
  for (Vec4f& p : moved) p.head<3>() = (turn * p.head<3>().cast<double>() + Vec3(0.05, 0.1, -0.03)).cast<float>();
  EXPECT_NEAR(engine.energy_j(moved), engine.energy_j(x), 1e-5 * engine.energy_j(x));
  const std::vector<Vec3> f = engine.forces_n(x), g = engine.forces_n(moved);
  for (std::size_t i = 0; i < f.size(); ++i) EXPECT_LT((turn * f[i] - g[i]).norm(), 2e-5 * norm(f)) << i;
}

INSTANTIATE_TEST_SUITE_P(conformance, EveryEngine, ::testing::ValuesIn(engines()), [](const auto& at) {
  std::string name = at.param.name;
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return name;
});

}  // namespace
}  // namespace sectio::tetra_test

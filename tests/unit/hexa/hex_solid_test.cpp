#include "sim_server/deformation/hexa/hex_solid.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sim_server/volume/tets/tet_cut.h"
#include "tests/support/pressed_block.h"
#include "tests/support/tet_shapes.h"
#include "tests/support/volume_settings.h"

namespace sectio::hexa_test {
namespace {

using test::at_rest;
using test::Points;
using test::still;

const Vec3 kSize(0.1, 0.05, 0.05);

TetMesh block(int n = 4) {
  return test::tet_box(2 * n, n, n, kSize);
}
Points nodes_at_rest(const HexLattice& lattice) {
  Points x(lattice.nodes.size(), Vec4f::Zero());
  for (std::uint32_t n = 0; n < x.size(); ++n) x[n].head<3>() = lattice.rest_m(n).cast<float>();
  return x;
}
HexSolid solid_of(const TetMesh& mesh, double cell_m, const VolumeSettings& settings, double poisson = 0.45,
                  VolumeIntegrator driver = VolumeIntegrator::automatic) {
  VolumeMaterial material;
  material.poisson = poisson;
  return HexSolid(mesh, grid_around(mesh, cell_m), material, settings, driver);
}
std::vector<Vec3> plane_at(double x) {
  return {Vec3(x, -1, -1), Vec3(x, 1, -1), Vec3(x, 1, 1), Vec3(x, -1, 1)};
}

TEST(HexSolid, both_drivers_feel_the_same_force) {
  double force_n[2];
  for (const VolumeIntegrator driver : {VolumeIntegrator::automatic, VolumeIntegrator::implicit_only})
    force_n[driver == VolumeIntegrator::implicit_only] = test::force_on_pressed_block_n(
        [&](const TetMesh& mesh, const VolumeMaterial& material, const VolumeSettings& settings) {
          return std::make_unique<HexSolid>(mesh, grid_around(mesh, 0.0125), material, settings, driver);
        });
  EXPECT_NEAR(force_n[1], force_n[0], 0.02 * force_n[0]);
}

TEST(HexKernel, registers_of_8_and_of_16_give_the_same_bits) {
  if (!has_avx512()) GTEST_SKIP() << "this processor has no AVX-512";
  const TetMesh mesh = block();
  const HexSolid solid = solid_of(mesh, 0.007, {});
  Points x = nodes_at_rest(solid.lattice());
  for (Vec4f& p : x) p.x() += 3 * p.y() * p.z();
  Points a(x.size(), Vec4f::Zero()), b = a;
  for (const bool bound : {false, true})
    EXPECT_EQ(add_forces(solid.rows(), bound, x, a, SimdWidth::eight),
              add_forces(solid.rows(), bound, x, b, SimdWidth::sixteen));
  EXPECT_EQ(a, b);
  EXPECT_GT(a[0].norm(), 0);
}

// The largest omega^2 of M^-1 K at a state, by power iteration on differences of the energy's forces in double
// precision: K u = -(f(x + e u) - f(x - e u)) / 2 e.
double largest_omega2(const HexSolid& solid, const Points& x, int iterations = 120) {
  std::vector<Vec3> u(x.size()), plus(x.size()), minus(x.size());
  for (std::size_t i = 0; i < u.size(); ++i)
    u[i] = Vec3(std::sin(3.0 * double(i)), std::sin(5.0 * double(i) + 1), std::sin(7.0 * double(i) + 2));
  double omega2 = 0;
  for (int n = 0; n < iterations; ++n) {
    double size = 0, most = 0;
    for (std::size_t i = 0; i < u.size(); ++i) most = std::max(most, u[i].norm());
    Points a = x, b = x;
    for (std::size_t i = 0; i < u.size(); ++i) {
      u[i] /= most;
      size += solid.node_mass_kg()[i] * u[i].squaredNorm();
      a[i].head<3>() += (1e-4 * u[i]).cast<float>();
      b[i].head<3>() -= (1e-4 * u[i]).cast<float>();
    }
    solid.elastic_forces_n(a, plus);
    solid.elastic_forces_n(b, minus);
    double work = 0;
    for (std::size_t i = 0; i < u.size(); ++i) {
      const Vec3 ku = (minus[i] - plus[i]) / 2e-4;
      work += u[i].dot(ku);
      u[i] = ku / solid.node_mass_kg()[i];
    }
    omega2 = work / size;
  }
  return omega2;
}

// dt_crit = 0.85 h / c_p of a bar; the bound that holds for one cell alone is 0.62 h / c_p.
TEST(HexSolid, S_1_the_bound_is_one_and_close) {
  const TetMesh mesh = block();
  const HexSolid solid = solid_of(mesh, 0.0125, test::weightless(0.001));
  const Points x = nodes_at_rest(solid.lattice());
  const double mu = solid.material().shear_pa, p_wave = std::sqrt((solid.material().bulk_pa + mu) / 1060);
  const double critical = 2 / std::sqrt(largest_omega2(solid, x)) * p_wave / 0.0125;
  EXPECT_NEAR(critical, 0.85, 0.04);
  const double bound = 2 / std::sqrt(omega2_at_rest(solid.material(), 0.0125, 1)) * p_wave / 0.0125;
  EXPECT_NEAR(bound, 0.616, 0.002);
  // A single cell attains the bound.
  const TetMesh cube = test::tet_box(1, 1, 1, Vec3::Constant(0.0125));
  const HexSolid one = solid_of(cube, 0.0125, test::weightless(0.001));
  EXPECT_NEAR(largest_omega2(one, nodes_at_rest(one.lattice())) / omega2_at_rest(one.material(), 0.0125, 1), 1, 0.02);
}

TEST(HexSolid, the_watched_bound_is_above_the_truth_in_deformed_states) {
  const TetMesh mesh = block(2);
  for (const double poisson : {0.3, 0.45, 0.49}) {
    const HexSolid solid = solid_of(mesh, 0.0125, test::weightless(0.001), poisson);
    for (const double s : {0.4, 0.7, 1.0, 1.5, 2.2}) {
      Points x = nodes_at_rest(solid.lattice()), force(x.size(), Vec4f::Zero());
      for (Vec4f& p : x) p.head<3>() = Vec3f(static_cast<float>(s) * p.x(), p.y(), p.z() + 4 * p.x() * p.y());
      EXPECT_GT(double{add_forces(solid.rows(), true, x, force)}, 0.99 * largest_omega2(solid, x)) << s;
    }
  }
}

// The stable step is independent of cuts and of the fill of cells.
TEST(HexSolid, the_stable_step_is_not_changed_by_cuts_nor_by_little_fill) {
  const TetMesh mesh = block();
  const Grid grid = grid_around(mesh, 0.0125);
  TetTopology volume(mesh);
  for (const double x : {0.03, 0.0337, 0.0376, 0.0624875}) cut(volume, {plane_at(x)}, {});
  cut(volume, {{Vec3(-1, 0.02, -1), Vec3(1, 0.021, -1), Vec3(1, 0.03, 1), Vec3(-1, 0.03, 1)}}, {});
  const HexSolid whole(mesh, grid, {}, test::weightless(0.001)),
      pieces(volume.mesh(), grid, {}, test::weightless(0.001));
  double least = 1;
  for (const HexCell& cell : pieces.lattice().cells) least = std::min(least, cell.fill);
  EXPECT_LT(least, 2e-3);
  EXPECT_EQ(pieces.explicit_limit_s(), whole.explicit_limit_s());
  EXPECT_EQ(pieces.substeps(), whole.substeps());
  EXPECT_LT(largest_omega2(pieces, nodes_at_rest(pieces.lattice())),
            1.01 * omega2_at_rest(pieces.material(), 0.0125, 1));
  // The same for a lattice whose border cells are almost empty.
  const TetMesh slice = test::tet_box(2, 2, 2, Vec3(0.0251, 0.02501, 0.025));
  const HexSolid thin = solid_of(slice, 0.0125, test::weightless(0.001));
  EXPECT_LT(largest_omega2(thin, nodes_at_rest(thin.lattice())), 1.01 * omega2_at_rest(thin.material(), 0.0125, 1));
}

TEST(HexSolid, a_cut_body_goes_on_as_it_was) {
  const TetMesh mesh = block();
  const Grid grid = grid_around(mesh, 0.0125);
  HexSolid solid(mesh, grid, {}, test::held_at_end(mesh, 0.001));
  Points x = at_rest(mesh), v = still(x);
  for (int n = 0; n < 120; ++n) solid.step(x, v, {}, {});
  TetTopology volume(mesh);
  cut(volume, {plane_at(0.043)}, {});
  const TetMesh halves = volume.mesh();
  HexSolid after(halves, grid, {}, test::held_at_end(halves, 0.001), VolumeIntegrator::automatic, &solid);
  HexSolid followed(mesh, grid, {}, test::held_at_end(mesh, 0.001), VolumeIntegrator::automatic, &solid);
  followed.change(volume.change());
  EXPECT_EQ(followed.node_position_world_m().size(), after.node_position_world_m().size());
  EXPECT_NEAR(followed.energy_j({}, {}), after.energy_j({}, {}), 1e-9 * std::abs(after.energy_j({}, {})));
  EXPECT_EQ(followed.explicit_limit_s(), solid.explicit_limit_s());
  const auto momentum = [](const HexSolid& s) {
    Vec3 p = Vec3::Zero();
    for (std::size_t n = 0; n < s.node_mass_kg().size(); ++n)
      p += s.node_mass_kg()[n] * s.node_velocity_m_per_s()[n].head<3>().cast<double>();
    return p;
  };
  EXPECT_GT(momentum(solid).norm(), 1e-3);
  EXPECT_LT((momentum(solid) - momentum(after)).norm(), 1e-6 * momentum(solid).norm());
  // Each copy has the deformation at the centroid of its own material, so that energy is equal in uniform strain only.
  const double elastic_j = solid.elastic_energy_j(solid.node_position_world_m());
  EXPECT_NEAR(after.energy_j({}, {}), solid.energy_j({}, {}), 0.02 * elastic_j);
  Points y(halves.vertices_body_m.size(), Vec4f::Zero()), u = y;
  for (int n = 0; n < 60; ++n) after.step(y, u, {}, {});
  double tip = 0, root = 0;
  for (std::size_t i = 0; i < y.size(); ++i) {
    const double down = halves.vertices_body_m[i].z() - double{y[i].z()};
    if (halves.vertices_body_m[i].x() > 0.099) tip = std::max(tip, down);
    if (halves.vertices_body_m[i].x() < 0.04) root = std::max(root, down);
  }
  EXPECT_GT(tip, 0.015);
  EXPECT_LT(root, 0.012);
  EXPECT_EQ(after.diagnostics().implicit_steps, 0u);
}

TEST(HexSolid, both_integrators_come_to_rest_in_the_same_place) {
  const TetMesh mesh = block(2);
  Points ends[2];
  for (const VolumeIntegrator driver : {VolumeIntegrator::automatic, VolumeIntegrator::implicit_only}) {
    VolumeMaterial soft;
    soft.young_pa = 20000;
    HexSolid solid(mesh, grid_around(mesh, 0.025), soft, test::held_at_end(mesh, 0.001), driver);
    Points x = at_rest(mesh), v = still(x);
    for (int n = 0; n < 1500; ++n) solid.step(x, v, {}, {});
    EXPECT_EQ(solid.diagnostics().implicit_steps, 0u);
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

TEST(HexDescent, never_raises_the_objective_and_mends_what_is_inverted) {
  const TetMesh mesh = block(2);
  for (const double poisson : {0.3, 0.45, 0.49}) {
    const HexSolid solid = solid_of(mesh, 0.0125, test::weightless(0.016), poisson);
    const HexDescent descent(solid.lattice(), solid.material());
    std::vector<Vec3> y;
    for (std::uint32_t n = 0; n < solid.lattice().nodes.size(); ++n) y.push_back(solid.lattice().rest_m(n));
    const auto objective = [&](const std::vector<Vec3>& x) {
      double sum = descent.elastic_energy_j(x);
      for (std::size_t n = 0; n < x.size(); ++n)
        sum += solid.node_mass_kg()[n] * (x[n] - y[n]).squaredNorm() / (2 * 0.016 * 0.016);
      return sum;
    };
    for (const int kind : {0, 1, 2}) {
      std::vector<Vec3> x = y;
      std::uint32_t seed = 7;
      for (Vec3& p : x) {
        if (kind == 0) p.z() *= 0.02;
        if (kind == 1) p.x() = -p.x();
        for (int k = 0; kind == 2 && k < 3; ++k) {
          seed = seed * 1664525 + 1013904223;
          p[k] = 0.1 * double(seed >> 8) / (1 << 24);
        }
      }
      const double first = objective(x);
      double before = first;
      for (int n = 0; n < 300; ++n) {
        descent.sweep(0.016, solid.node_mass_kg(), y, x);
        const double after = objective(x);
        ASSERT_LE(after, before + 1e-12 * first) << kind << " " << n;
        before = after;
      }
      EXPECT_LT(before, 1e-3 * first) << kind;
    }
  }
}

// The body is stretched until the substeps of the rest state are too long, and released.
TEST(HexSolid, a_stretched_body_gets_more_parts) {
  const TetMesh mesh = block(3);
  const double limit_s = solid_of(mesh, 0.05 / 3, test::weightless(1e-5)).explicit_limit_s();
  HexSolid solid = solid_of(mesh, 0.05 / 3, test::weightless(1.999 * limit_s));
  EXPECT_EQ(solid.substeps(), 2);
  Points x = at_rest(mesh), v = still(x);
  int most_parts = 0;
  for (int n = 0; n < 200; ++n) {
    std::vector<PointConstraint> ends;
    for (VertexId i = 0; i < x.size(); ++i) {
      const Vec3& home = mesh.vertices_body_m[i];
      if (home.x() > 0.003 && home.x() < 0.097) continue;
      ends.push_back(hold(i, Vec3(home.x() * (1 + std::min(2.0, n / 50.0)), home.y(), home.z())));
    }
    std::vector<Reaction> reactions(ends.size());
    solid.step(x, v, ends, reactions);
    most_parts = std::max(most_parts, solid.last_substeps());
  }
  EXPECT_GT(most_parts, 2);
  for (int n = 0; n < 600; ++n) solid.step(x, v, {}, {});
  EXPECT_EQ(solid.last_substeps(), 2);
  EXPECT_EQ(solid.diagnostics().implicit_steps, 0u);
}

// The body is inflated to five times its size in two directions, and squeezed flat.
TEST(HexSolid, the_implicit_driver_takes_over_where_the_bound_says_so_and_hands_back) {
  const TetMesh mesh = block(2);
  for (const Vec3f& scale : {Vec3f(5, 1, 5), Vec3f(1, 1, 0.05f)}) {
    HexSolid solid = solid_of(mesh, 0.025, test::weightless(0.001), 0.49);
    Points x = at_rest(mesh), v = still(x);
    solid.step(x, v, {}, {});
    for (int n = 0; n < 40; ++n) {  // until the nodes follow
      for (VertexId i = 0; i < x.size(); ++i) {
        x[i].head<3>() = scale.cwiseProduct(mesh.vertices_body_m[i].cast<float>());
        v[i].setZero();
      }
      solid.step(x, v, {}, {});
    }
    if (scale.x() > 1) {
      EXPECT_GT(solid.diagnostics().implicit_steps, 0u);
    }
    for (int n = 0; n < 1500; ++n) solid.step(x, v, {}, {});
    EXPECT_FALSE(solid.last_step_was_implicit());
    EXPECT_EQ(solid.first_bad_vertex(), kNone);
    EXPECT_LT(solid.elastic_energy_j(solid.node_position_world_m()), 1e-4 * 6000 * 0.05 * 0.05 * 0.1);
  }
}

// Constraints on points that are embedded in the middle of cells.
TEST(HexSolid, a_held_body_weighs_what_it_weighs) {
  const TetMesh mesh = block(2);
  HexSolid solid = solid_of(mesh, 0.017, {});
  Points x = at_rest(mesh), v = still(x);
  std::vector<PointConstraint> top;
  for (VertexId i = 0; i < x.size(); ++i)
    if (x[i].z() > 0.046f) top.push_back(hold(i, mesh.vertices_body_m[i]));
  std::vector<Reaction> reactions(top.size());
  Vec3 mean = Vec3::Zero();
  for (int n = 0; n < 1500; ++n) {
    solid.step(x, v, top, reactions);
    if (n < 1400) continue;
    for (const Reaction& r : reactions) mean += r.force_on_tool_n / 100;
  }
  const double mass = 1060 * check(mesh).volume_m3;
  EXPECT_NEAR(mean.z(), -mass * 9.81, 5e-3 * mass * 9.81);
}

// A change of a vertex's state from outside changes the nodes by the same momentum.
TEST(HexSolid, a_push_on_vertices_arrives) {
  const TetMesh mesh = block(2);
  HexSolid solid = solid_of(mesh, 0.017, test::weightless(0.0005));
  Points x = at_rest(mesh), v = still(x);
  solid.step(x, v, {}, {});
  Vec3 given = Vec3::Zero();
  for (VertexId i = 0; i < v.size(); ++i) {
    if (x[i].z() < 0.046f) continue;
    v[i].z() -= 0.1f;
    given.z() -= 0.1 / solid.inverse_mass_per_kg(i);
  }
  solid.step(x, v, {}, {});
  Vec3 has = Vec3::Zero();
  for (std::size_t n = 0; n < solid.node_mass_kg().size(); ++n)
    has += solid.node_mass_kg()[n] * solid.node_velocity_m_per_s()[n].head<3>().cast<double>();
  EXPECT_LT((has - (1 - 25 * 0.0005) * given).norm(), 2e-3 * given.norm());
}

TEST(HexSolid, a_turned_body_begins_where_it_is) {
  const TetMesh mesh = block(2);
  HexSolid solid = solid_of(mesh, 0.017, test::weightless(0.001));
  Pose pose;
  pose.position_m = Vec3(0.1, -0.2, 0.05);
  pose.orientation = Eigen::AngleAxisd(2.5, Vec3(1, 2, 3).normalized());
  Points x = at_rest(mesh), v = still(x);
  for (std::size_t i = 0; i < x.size(); ++i) x[i].head<3>() = pose.to_world(mesh.vertices_body_m[i]).cast<float>();
  const Points start = x;
  for (int n = 0; n < 20; ++n) solid.step(x, v, {}, {});
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_LT((x[i] - start[i]).norm(), 1e-6f);
}

}  // namespace
}  // namespace sectio::hexa_test

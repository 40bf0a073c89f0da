// The implicit driver: its Hessians against differences of forces, what it leaves over, and wrecks.
#include "sim_server/deformation/implicit_driver.h"

#include <gtest/gtest.h>

#include "common/math/fixed_sequence.h"
#include "sim_server/deformation/hexa/hex_solid.h"
#include "sim_server/deformation/tetra/tet_solid.h"
#include "sim_server/deformation/tetra/tet_springs.h"
#include "tests/support/tet_shapes.h"
#include "tests/support/volume_settings.h"

namespace sectio::hexa_test {
namespace {

using test::Points;

TetMesh coarse_bar() {
  return test::tet_box(8, 2, 2, Vec3(0.2, 0.05, 0.05));
}
VolumeMaterial material(double young_pa, double poisson = 0.4) {
  VolumeMaterial m;
  m.young_pa = young_pa;
  m.poisson = poisson;
  return m;
}

// K p against the difference of forces at x + e p and x - e p, without its error in e^2, which that of 2 e tells.
// Forces of tetrahedra are floats, so that e can't be small.
double error_of_product(ElasticEnergy& energy, const std::vector<Vec3>& x, double e) {
  std::vector<Vec4f> p(x.size(), Vec4f::Zero()), product = p;
  for (std::size_t i = 0; i < x.size(); ++i) p[i].head<3>() = fixed_vector(i + 1000).cast<float>();
  std::vector<Vec3> slope(x.size(), Vec3::Zero());
  for (const auto& [step, weight] :
       {std::pair{e, 4.0 / 3}, std::pair{-e, 4.0 / 3}, std::pair{2 * e, -1.0 / 3}, std::pair{-2 * e, -1.0 / 3}}) {
    std::vector<Vec3> at = x, f(x.size(), Vec3::Zero());
    for (std::size_t i = 0; i < x.size(); ++i) at[i] += step * p[i].head<3>().cast<double>();
    energy.add_forces(at, f);
    for (std::size_t i = 0; i < x.size(); ++i) slope[i] -= weight / (2 * step) * f[i];
  }
  energy.linearise(x);
  energy.add_product(p, product);
  double wrong = 0, size = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    wrong += (product[i].head<3>().cast<double>() - slope[i]).squaredNorm();
    size += slope[i].squaredNorm();
  }
  return std::sqrt(wrong / size);
}

std::vector<Vec3> shaken(std::vector<Vec3> x, double by_m) {
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = 1.02 * x[i] + by_m * fixed_vector(i);
  return x;
}

TEST(Implicit, products_are_differences_of_forces) {
  const TetMesh mesh = coarse_bar();
  TetSolid solid(mesh, material(1e5), test::held_at_end(mesh, 1e-9, 0.001));
  EXPECT_LT(error_of_product(solid.energy(), shaken(mesh.vertices_body_m, 1e-4), 8e-4), 1e-5);
  HexSolid lattice(mesh, grid_around(mesh, 0.025), material(1e5), test::held_at_end(mesh, 1e-9, 0.001));
  std::vector<Vec3> nodes;
  for (std::uint32_t n = 0; n < lattice.lattice().nodes.size(); ++n) nodes.push_back(lattice.lattice().rest_m(n));
  EXPECT_LT(error_of_product(lattice.energy(), shaken(nodes, 1e-4), 1e-6), 1e-5);
  const TetSprings springs(mesh, material(1e5), test::held_at_end(mesh, 1e-9, 0.001));
  SpringEnergy energy;
  energy.read(springs.rows(), static_cast<std::uint32_t>(mesh.vertices_body_m.size()));
  std::vector<Vec3> longer = mesh.vertices_body_m;
  for (Vec3& x : longer) x *= 1.1;  // no spring is shorter than at rest
  EXPECT_LT(error_of_product(energy, shaken(longer, 1e-4), 1e-6), 1e-5);
}

TEST(Implicit, blocks_are_those_of_the_product) {
  const TetMesh mesh = coarse_bar();
  TetSolid solid(mesh, material(1e5), test::held_at_end(mesh, 1e-9, 0.001));
  const std::vector<Vec3> x = shaken(mesh.vertices_body_m, 1e-4);
  solid.energy().linearise(x);
  std::vector<Mat3> blocks(x.size(), Mat3::Zero());
  solid.energy().add_blocks(blocks);
  for (std::size_t v = 0; v < x.size(); v += 7)
    for (int k = 0; k < 3; ++k) {
      std::vector<Vec4f> p(x.size(), Vec4f::Zero()), y = p;
      p[v][k] = 1;
      solid.energy().add_product(p, y);
      EXPECT_LT((y[v].head<3>().cast<double>() - blocks[v].col(k)).norm(), 1e-4 * blocks[v].norm());
    }
}

double lowest_m(std::span<const Vec4f> x) {
  return double{std::ranges::min(x, {}, [](const Vec4f& p) { return p.z(); }).z()};
}

class Sag : public testing::TestWithParam<std::string> {
 protected:
  std::unique_ptr<VolumeModel> make(const TetMesh& mesh, double step_s) const {
    const VolumeSettings settings = test::held_at_end(mesh, 1e-9, step_s);
    if (GetParam() == "solid")
      return std::make_unique<TetSolid>(mesh, material(1e5), settings, VolumeIntegrator::implicit_only);
    return std::make_unique<HexSolid>(mesh, grid_around(mesh, 0.025), material(1e5), settings,
                                      VolumeIntegrator::implicit_only);
  }
};
INSTANTIATE_TEST_SUITE_P(All, Sag, testing::Values("solid", "lattice"), [](const auto& p) { return p.param; });

TEST_P(Sag, is_the_same_with_steps_of_1_and_100_ms_and_what_is_left_over_is_small) {
  const TetMesh mesh = coarse_bar();
  double sag_m[2];
  for (const double step_s : {0.001, 0.1}) {
    const auto model = make(mesh, step_s);
    Points x = test::at_rest(mesh), v = test::still(x);
    for (int n = 0; n * step_s < 3; ++n) {
      model->step(x, v, {}, {});
      ASSERT_LT(model->diagnostics().residual, step_s < 0.01 ? 0.05 : NewtonStep::kLongTolerance) << step_s << " " << n;
    }
    EXPECT_EQ(model->diagnostics().steps_not_met, 0u);
    sag_m[step_s > 0.01] = -lowest_m(x);
  }
  EXPECT_GT(sag_m[0], 0.02);
  EXPECT_NEAR(sag_m[1] / sag_m[0], 1, 0.01);
}

// Flattened to 2 %, and scrambled by an edge: the shape at rest comes back.
TEST_P(Sag, wrecks_return) {
  const TetMesh mesh = coarse_bar();
  for (const double step_s : {0.001, 0.0167}) {
    for (const bool scrambled : {false, true}) {
      const auto model = make(mesh, step_s);
      model->set_gravity(Vec3::Zero());
      Points x = test::at_rest(mesh), v = test::still(x);
      for (VertexId i = 0; i < x.size(); ++i) {
        if (model->inverse_mass_per_kg(i) == 0) continue;
        if (scrambled)
          x[i].head<3>() += (0.025 * fixed_vector(i)).cast<float>();
        else
          x[i].z() *= 0.02f;
      }
      for (int n = 0; n * step_s < 3; ++n) model->step(x, v, {}, {});
      double away_m = 0;
      for (VertexId i = 0; i < x.size(); ++i)
        away_m = std::max(away_m, (x[i].head<3>().cast<double>() - mesh.vertices_body_m[i]).norm());
      EXPECT_LT(away_m, 1e-4) << step_s << (scrambled ? " scrambled" : " flattened");
    }
  }
}

// A patch pressed in by 5 mm: where it should be, with the force that the elastic forces answer.
TEST(Implicit, held_points_are_where_they_are_held) {
  const TetMesh mesh = coarse_bar();
  TetSolid solid(mesh, material(1e5), test::held_at_end(mesh, 1e-9, 0.001), VolumeIntegrator::implicit_only);
  solid.set_gravity(Vec3::Zero());
  Points x = test::at_rest(mesh), v = test::still(x);
  std::vector<PointConstraint> holds;
  for (VertexId i = 0; i < x.size(); ++i)
    if (mesh.vertices_body_m[i].x() > 0.199) holds.push_back(hold(i, mesh.vertices_body_m[i] - Vec3(0, 0, 0.005)));
  std::vector<Reaction> reactions(holds.size());
  for (int n = 0; n < 1000; ++n) solid.step(x, v, holds, reactions);
  Vec3 sum = Vec3::Zero();
  for (const Reaction& r : reactions) sum += r.force_on_tool_n;
  for (const PointConstraint& c : holds)
    EXPECT_LT((x[c.v[0]].head<3>().cast<double>() - c.target_world_m).norm(), 2e-6);
  std::vector<Vec3> f(x.size(), Vec3::Zero());
  solid.elastic_forces_n(x, f);
  Vec3 elastic = Vec3::Zero();
  for (const PointConstraint& c : holds) elastic += f[c.v[0]];
  EXPECT_LT((elastic - sum).norm(), 0.02 * sum.norm());
  EXPECT_EQ(solid.diagnostics().steps_not_met, 0u);
}

// A block that falls 5 mm onto a floor, on which it then lies: each vertex beneath is pressed up, and comes off freely.
TEST(Implicit, what_lies_on_a_floor_is_in_equilibrium_in_every_step) {
  const TetMesh mesh = test::tet_box(6, 6, 3, Vec3(0.06, 0.06, 0.03));
  for (const double step_s : {0.001, 1.0 / 60}) {
    VolumeSettings settings;
    settings.step_s = step_s;
    settings.fixed.assign(mesh.vertices_body_m.size(), 0);
    TetSolid solid(mesh, material(1e4, 0.45), settings, VolumeIntegrator::implicit_only);
    Points x = test::at_rest(mesh), v = test::still(x);
    for (Vec4f& at : x) at.z() += 0.005f;
    std::vector<Reaction> reactions;
    for (int n = 0; n * step_s < 1; ++n) {
      std::vector<PointConstraint> floor;
      for (VertexId i = 0; i < x.size(); ++i) {
        if (x[i].z() > 0.012f) continue;
        PointConstraint c = hold(i, {x[i].x(), x[i].y(), 0});
        c.unilateral = true;
        c.normal = -Vec3::UnitZ();
        floor.push_back(c);
      }
      reactions.assign(floor.size(), {});
      solid.step(x, v, floor, reactions);
    }
    EXPECT_EQ(solid.diagnostics().steps_not_met, 0u) << step_s;
    double weight_n = 0, borne_n = 0;
    for (VertexId i = 0; i < x.size(); ++i) weight_n += 9.81 * solid.mass_kg(i);
    for (const Reaction& r : reactions) borne_n -= r.force_on_tool_n.z();
    EXPECT_NEAR(borne_n / weight_n, 1, 0.02) << step_s;
  }
}

}  // namespace
}  // namespace sectio::hexa_test

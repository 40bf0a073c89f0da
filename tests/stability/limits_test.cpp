// The step at which each model becomes unstable, measured, against what it predicts.
#include <gtest/gtest.h>

#include "sim_server/deformation/hexa/hex_solid.h"
#include "sim_server/deformation/tetra/tet_solid.h"
#include "sim_server/deformation/tetra/tet_springs.h"
#include "tests/support/explicit_limit.h"

namespace sectio {
namespace {

using test::growth_decades_per_step;
using test::kModels;
using test::measured_limit_s;
using test::Model;
using test::Oscillator;

class Models : public testing::TestWithParam<Model> {};
INSTANTIATE_TEST_SUITE_P(All, Models, testing::ValuesIn(kModels),
                         [](const auto& model) { return test::name_of(model.param); });

TEST_P(Models, S_1_what_is_predicted_is_below_what_is_measured_and_at_most_half_of_it) {
  for (const double poisson : {0.3, 0.45, 0.49}) {
    const Oscillator body = test::oscillator(GetParam(), 6000, poisson);
    for (const double k : {0.2, 0.5, 0.8, 0.95})
      EXPECT_EQ(growth_decades_per_step(body, k * body.predicted_s), 0) << poisson << " " << k;
    const double measured_s = measured_limit_s(body);
    RecordProperty("measured_over_predicted_" + std::to_string(poisson), std::to_string(measured_s / body.predicted_s));
    EXPECT_GE(measured_s, body.predicted_s) << poisson;
    EXPECT_LE(measured_s, 2 * body.predicted_s) << poisson;
    for (const double k : {1.1, 1.3, 2.0})
      EXPECT_GT(growth_decades_per_step(body, k * measured_s), 0) << poisson << " " << k;
  }
}

// The limits by which the drivers divide their steps, damping included: the real drivers, one part a step.
TEST(Limits, S_1_drivers_stay_below_them) {
  const TetMesh mesh = test::bar_for_limits();
  for (const double poisson : {0.3, 0.45, 0.49}) {
    VolumeSettings settings = test::undisturbed();
    const VolumeMaterial material = test::undamped(6000, poisson);
    const TetSolid solid(mesh, material, settings);
    const HexSolid lattice(mesh, grid_around(mesh, test::kCell_m), material, settings);
    const TetSprings springs(mesh, material, settings);
    const double measured_s[] = {measured_limit_s(test::solid_of(mesh, material)),
                                 measured_limit_s(test::lattice_of(mesh, material, test::kCell_m)),
                                 measured_limit_s(test::springs_of(mesh, material))};
    EXPECT_NEAR(solid.explicit_limit_s() / measured_s[0], poisson > 0.47 ? 0.45 : 0.6, 0.03);
    EXPECT_LE(lattice.explicit_limit_s(), 0.8 * measured_s[1]);
    EXPECT_LE(springs.substep_limit_s(), 0.8 * measured_s[2]);
  }
}

TEST_P(Models, S_2_the_limit_falls_with_the_root_of_the_stiffness) {
  constexpr int kSteps = 6;
  double sum_x = 0, sum_y = 0, sum_xx = 0, sum_xy = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const double decades = 3.0 * i / kSteps;
    const double y = std::log10(measured_limit_s(test::oscillator(GetParam(), 1000 * std::pow(10, decades), 0.45)));
    sum_x += decades, sum_y += y, sum_xx += decades * decades, sum_xy += decades * y;
  }
  const double n = kSteps + 1, slope = (n * sum_xy - sum_x * sum_y) / (n * sum_xx - sum_x * sum_x);
  EXPECT_NEAR(slope, -0.5, 0.03);
}

// The limit falls with the speed of pressure waves, sqrt(1 - 2 nu), as nu goes to 1/2. Springs don't know of it.
TEST(Limits, S_2_the_limit_falls_with_the_compressibility) {
  const auto p_wave = [](double nu) { return std::sqrt((1 - nu) / ((1 + nu) * (1 - 2 * nu))); };
  for (const Model model : {Model::neo_hookean, Model::neo_hookean_lattice}) {
    const double near_s = measured_limit_s(test::oscillator(model, 6000, 0.49)),
                 nearer_s = measured_limit_s(test::oscillator(model, 6000, 0.499));
    SCOPED_TRACE(test::name_of(model));
    EXPECT_NEAR(near_s / nearer_s, p_wave(0.499) / p_wave(0.49), 0.05 * p_wave(0.499) / p_wave(0.49));
  }
  EXPECT_NEAR(measured_limit_s(test::oscillator(Model::tetra_springs, 6000, 0.49)) /
                  measured_limit_s(test::oscillator(Model::tetra_springs, 6000, 0.3)),
              1, 0.02);
}

// The bound of linear elements; with nodal pressures the solid is softer than that.
TEST(Limits, S_1_the_bound_from_rows_is_rigorous) {
  const TetMesh mesh = test::bar_for_limits();
  for (const double poisson : {0.3, 0.45, 0.49}) {
    const VolumeMaterial material = test::undamped(6000, poisson);
    const Oscillator body = test::solid_of(mesh, material);
    const double ratio = measured_limit_s(body) / test::row_bound_s(mesh, material, body.inverse_mass);
    EXPECT_GE(ratio, 1) << poisson;
    EXPECT_LE(ratio, 2.6) << poisson;
  }
}

double mass_kg(const Oscillator& body) {
  double sum_kg = 0;
  for (const double inverse : body.inverse_mass) sum_kg += inverse > 0 ? 1 / inverse : 0;
  return sum_kg;
}

// The thinner the slivers beside a cut, the smaller the limit. With mass added to their vertices it stays where it was
// asked to be; a whole sheet of very thin ones would need more than a body may get. The lattice has none.
TEST(Limits, S_3_slivers_with_and_without_added_mass) {
  const VolumeMaterial material = test::undamped(6000, 0.45);
  const TetMesh coarse = test::bar_with_slivers(0.5);
  const double solid_s = test::row_bound_s(coarse, material, test::solid_of(coarse, material).inverse_mass),
               springs_s = test::springs_of(coarse, material).predicted_s,
               lattice_s = measured_limit_s(test::lattice_of(coarse, material, test::kCell_m));
  double before_s = HUGE_VAL;
  for (const double sliver : {1e-1, 1e-2, 1e-3, 1e-4}) {
    const TetMesh mesh = test::bar_with_slivers(sliver);
    const auto limit_s = [&](Oscillator body) {
      body.small_m = std::min(body.small_m, 0.1 * sliver * test::kCell_m);
      return measured_limit_s(body);
    };
    const Oscillator bare = test::solid_of(mesh, material), heavy = test::solid_of(mesh, material, 0.8 * solid_s);
    const double bare_s = limit_s(bare);
    EXPECT_LT(bare_s, 0.7 * before_s) << sliver;
    EXPECT_GE(bare_s, test::row_bound_s(mesh, material, bare.inverse_mass)) << sliver;
    before_s = bare_s;
    const Oscillator springs = test::springs_of(mesh, material, 0.6 * springs_s);
    if (sliver >= 0.1) {
      EXPECT_GE(test::row_bound_s(mesh, material, heavy.inverse_mass), 0.8 * solid_s) << sliver;
      EXPECT_GE(limit_s(heavy), 0.8 * solid_s) << sliver;
      EXPECT_GE(springs.predicted_s, 0.6 * springs_s) << sliver;
    }
    for (const Oscillator& body : {heavy, springs}) EXPECT_LE(mass_kg(body), (1 + kMostAddedMass) * mass_kg(bare));
    EXPECT_GE(limit_s(springs), 0.98 * springs.predicted_s) << sliver;  // a heavy pair's prediction is the limit itself
    EXPECT_NEAR(limit_s(test::lattice_of(mesh, material, test::kCell_m)) / lattice_s, 1, 0.25) << sliver;
  }
}

// Half of the bar a thousand times as stiff: its part of the bound holds for all.
TEST(Limits, S_7_stiffness_of_a_thousand_to_one) {
  const TetMesh mesh = test::bar_for_limits();
  VolumeMaterial material = test::undamped(6000, 0.45), stiff = material;
  for (const Tetrahedron& t : mesh.tetrahedra) {
    double x = 0;
    for (const VertexId v : t) x += mesh.vertices_body_m[v].x() / 4;
    material.stiffness_factor.push_back(x > 0.05 ? 1000 : 1);
  }
  stiff.young_pa *= 1000;
  const auto judge = [](const char* name, const Oscillator& mixed, const Oscillator& all_stiff) {
    const double measured_s = measured_limit_s(mixed);
    EXPECT_GE(measured_s, mixed.predicted_s) << name;
    EXPECT_LE(measured_s, 2 * mixed.predicted_s) << name;
    EXPECT_NEAR(measured_s / measured_limit_s(all_stiff), 1, 0.15) << name;
  };
  judge("springs", test::springs_of(mesh, material), test::springs_of(mesh, stiff));
  judge("solid", test::solid_of(mesh, material), test::solid_of(mesh, stiff));
  judge("lattice", test::lattice_of(mesh, material, test::kCell_m), test::lattice_of(mesh, stiff, test::kCell_m));
}

// Tissue has one density; vertices of small tetrahedra beside large ones have masses like 1 to 100.
TEST(Limits, S_7_masses_of_a_hundred_to_one) {
  TetMesh mesh = test::tet_box(12, 2, 2, Vec3(1, 0.04, 0.04));
  for (Vec3& p : mesh.vertices_body_m) p.x() = 0.02 * (std::pow(120, p.x()) - 1) / 119 * 5;
  const VolumeMaterial material = test::undamped(6000, 0.45);
  for (const Oscillator& body : {test::springs_of(mesh, material), test::solid_of(mesh, material)}) {
    const auto [least, most] = std::ranges::minmax(body.inverse_mass);
    EXPECT_GT(most / least, 100);
    const double measured_s = measured_limit_s(body);
    EXPECT_GE(measured_s, body.predicted_s);
    EXPECT_LE(measured_s, 2 * body.predicted_s);
  }
}

}  // namespace
}  // namespace sectio

#include "sim_server/planning/error_law.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "common/core/error.h"
#include "tests/support/planning_methods.h"

namespace sectio::planning {
namespace {

using test::method;

std::string read_file(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(ErrorLaws, of_the_tree_are_what_the_fit_of_the_chart_gives) {
  const auto points = read_chart(read_file(SECTIO_SOURCE_DIR "/docs/chart.csv"));
  ASSERT_GT(points.size(), 80u);
  EXPECT_EQ(to_text(fit_laws(points)), read_file(SECTIO_SOURCE_DIR "/sim_server/planning/fitted_laws.inc"))
      << "the chart was measured anew? then: ninja renew_error_laws";
}

TEST(ErrorLaws, are_found_again_in_points_that_follow_one) {
  std::vector<MeasuredError> points;
  const ErrorLaw law{0.8, 1.6, 0.05};
  for (const double n : {2, 3, 4, 6, 8, 12}) points.push_back({Load::twisting, "lattice", n, law.at(n)});
  points.push_back({Load::twisting, "lattice", 5, 3 * law.at(5)});  // a run that failed
  const auto fitted = fit_laws(points);
  ASSERT_EQ(fitted.size(), 1u);
  for (const double n : {2, 5, 12}) EXPECT_NEAR(fitted[0].law.at(n) / law.at(n), 1, 0.02);
}

TEST(ErrorLaws, need_the_tables_columns) {
  EXPECT_THROW(read_chart("scene,model\n"), InputError);
}

TEST(ErrorLaws, get_smaller_with_cells_and_claim_what_was_measured) {
  for (const Method& method : test::methods()) {
    EXPECT_TRUE(!method.needs_volume() || method.laws.size() == std::size_t{kLoads}) << method.name;
    for (const LoadLaw& law : method.laws) EXPECT_GE(law.law.at(2), law.law.at(8)) << method.name;
  }
  const auto has_law = [](Load load) {
    return std::ranges::count(method("surface_springs").laws, load, &LoadLaw::load) > 0;
  };
  EXPECT_TRUE(has_law(Load::indentation));
  EXPECT_FALSE(has_law(Load::bending)) << "a surface has no inside that bends";
}

// G = E / (2 (1 + nu)): springs, whose Poisson's ratio is at most 1/4, represent tissue of that ratio better.
TEST(ErrorLaws, of_springs_know_poissons_ratio) {
  const auto twisted = [](double nu) {
    return *relative_error({Load::twisting, 0.02, nu}, method("tetra_springs"), 0.002);
  };
  EXPECT_LT(twisted(0.25), twisted(0.45));
  const auto pressed = [](double nu) {
    return *relative_error({Load::indentation, 0.02, nu}, method("tetra_springs"), 0.002);
  };
  EXPECT_LT(pressed(0.3), pressed(0.49));
}

TEST(ErrorLaws, of_surface_springs_know_their_bed) {
  const auto pressed = [](double chi, double bed_ratio) {
    return *relative_error({Load::indentation, 0.01, 0.45, chi, bed_ratio}, method("surface_springs"), 0.003);
  };
  EXPECT_LT(pressed(0.2236, 1), pressed(0.2236, 3));
  EXPECT_LT(pressed(0.2236, 1), pressed(0.6, 1)) << "a thin layer is stiffer than a bed";
}

TEST(ErrorLaws, layer_is_a_half_space_when_it_is_thick) {
  EXPECT_NEAR(layer_stiffness(0.3, 1e-6), 1 / (1 - 0.09), 1e-4);
  EXPECT_GT(layer_stiffness(0.45, 0.4), layer_stiffness(0.45, 0.2));
}

}  // namespace
}  // namespace sectio::planning

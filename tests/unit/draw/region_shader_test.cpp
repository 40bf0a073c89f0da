#include "render_client/draw/region_shader.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace sectio::draw_test {
namespace {

TEST(RegionTable, no_cell_misses_a_part_that_is_there) {
  test::Random random(11);
  std::uniform_real_distribution<double> place(-0.06, 0.06), size(0.001, 0.02), turn(-1, 1);
  const Eigen::AlignedBox3d body(Vec3(-0.05, -0.03, -0.02), Vec3(0.05, 0.03, 0.02));
  const auto vector = [&](auto& of) { return Vec3(of(random), of(random), of(random)); };
  int inside = 0;
  for (int round = 0; round < 20; ++round) {
    Regions regions(4);
    for (std::size_t i = 0; i < 32; ++i) {
      Region& region = regions[i / 8];
      region.ripple_m = 0.001 * static_cast<double>(i / 8);
      const auto form = static_cast<RegionForm>(random() % 3);
      const Eigen::Quaterniond q(Eigen::AngleAxisd(3 * turn(random), vector(turn).normalized()));
      const Vec3 b = form == RegionForm::tube ? vector(place) : vector(size);
      region.parts.push_back({form, vector(place), b, 0.3 * size(random), 0.3 * size(random), q});
    }
    const RegionTable table = region_table(regions, body);
    EXPECT_EQ(table.count, 4);
    for (int n = 0; n < 2000; ++n) {
      const Vec3 x = 0.5 * vector(turn).cwiseProduct(body.sizes());
      const Eigen::Array3i cell =
          ((x.cast<float>() - table.grid_from_m).cwiseProduct(table.grid_per_m)).array().floor().cast<int>();
      const std::uint32_t bits =
          table.cells[static_cast<std::size_t>((cell.z() * kRegionGridSize + cell.y()) * kRegionGridSize + cell.x())];
      for (std::size_t i = 0; i < 32; ++i) {
        const Region& region = regions[i / 8];
        if (signed_distance_m(region.parts[i % 8], x) > region.ripple_m * ripple_at(x)) continue;
        ++inside;
        ASSERT_TRUE(bits >> i & 1) << "part " << i << " at " << x.transpose();
      }
    }
  }
  EXPECT_GT(inside, 5000);
}

TEST(RegionTable, most_of_a_body_is_near_few_parts) {
  Region vessel;
  vessel.parts = {{RegionForm::tube, Vec3(-0.05, 0, 0), Vec3(0.05, 0, 0), 0.002, 0.002}};
  const RegionTable table = region_table(std::array{vessel}, {Vec3::Constant(-0.05), Vec3::Constant(0.05)});
  EXPECT_LT(std::ranges::count_if(table.cells, [](std::uint32_t bits) { return bits != 0; }),
            static_cast<std::ptrdiff_t>(table.cells.size() / 10));
}

}  // namespace
}  // namespace sectio::draw_test

#include "sim_server/volume/tets/bridges.h"

#include <gtest/gtest.h>

#include <numeric>

#include "sim_server/volume/tets/tet_cut.h"
#include "tests/support/tet_shapes.h"

namespace sectio::tets_test {
namespace {

constexpr double kSide_m = 0.06;
const Vec3 kOn_m(0.031, 0.0327, 0.0291), kNormal = Vec3(0.1, 1, 0.05).normalized();

std::optional<double> height_m(const Vec3& at_m) {
  const double m = kNormal.dot(at_m - kOn_m);
  return std::abs(m) < 0.02 ? std::optional(m) : std::nullopt;
}
// The cut begins inside the body, so far from its side.
TetTopology cut_from(double x_m) {
  TetTopology volume(test::tet_box(4, 4, 4, Vec3(kSide_m, kSide_m, kSide_m)));
  const auto on_plane = [](double x, double z) {
    return Vec3(x, kOn_m.y() - (kNormal.x() * (x - kOn_m.x()) + kNormal.z() * (z - kOn_m.z())) / kNormal.y(), z);
  };
  cut(volume, {{on_plane(x_m, -1), on_plane(x_m, 1), on_plane(1, 1), on_plane(1, -1)}}, {});
  return volume;
}
std::vector<VertexId> open(TetTopology& volume) {
  std::vector<std::uint32_t> all(volume.tetrahedra().size());
  std::iota(all.begin(), all.end(), 0u);
  return open_bridges(volume, height_m, 0.007, all);
}

TEST(Bridges, a_thread_at_the_side_where_the_cut_began_is_opened) {
  TetTopology volume = cut_from(0.012);
  ASSERT_EQ(volume.connected({0}).size(), volume.tetrahedra().size());
  EXPECT_FALSE(open(volume).empty());
  EXPECT_LT(volume.connected({0}).size(), volume.tetrahedra().size());
  EXPECT_TRUE(open(volume).empty());
}

// The surface by which a blade came may lie beside the cut that it made.
TEST(Bridges, no_more_is_opened_than_what_still_holds) {
  TetTopology volume = cut_from(0.012);
  std::vector<std::uint32_t> all(volume.tetrahedra().size());
  std::iota(all.begin(), all.end(), 0u);
  const auto beside_m = [](const Vec3& at_m) -> std::optional<double> {
    const double m = kNormal.dot(at_m - kOn_m) + 0.004;
    return std::abs(m) < 0.02 ? std::optional(m) : std::nullopt;
  };
  const std::size_t there = open_bridges(volume, beside_m, 0.007, all).size();
  EXPECT_LT(volume.connected({0}).size(), volume.tetrahedra().size());
  TetTopology as_cut = cut_from(0.012);
  EXPECT_LE(there, open(as_cut).size());
}

TEST(Bridges, what_is_apart_stays_as_it_is) {
  TetTopology volume = cut_from(-1);
  ASSERT_LT(volume.connected({0}).size(), volume.tetrahedra().size());
  const std::size_t before = volume.mark();
  EXPECT_TRUE(open(volume).empty());
  EXPECT_EQ(volume.mark(), before);
}

}  // namespace
}  // namespace sectio::tets_test

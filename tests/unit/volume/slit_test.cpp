#include "sim_server/volume/slit.h"

#include <gtest/gtest.h>

#include <numbers>

namespace sectio::volume_test {
namespace {

// An upright blade that goes round a centre: where it has come to.
BladeEdge on_arc(double angle_rad) {
  const Vec3 at(0.03 * std::cos(angle_rad), 0.03 * std::sin(angle_rad), 0);
  return {at - Vec3(0, 0, 0.02), at + Vec3(0, 0, 0.02)};
}
double radians(double degrees) {
  return degrees * std::numbers::pi / 180;
}

TEST(Slit, that_turns_by_more_than_a_right_angle_has_one_inner_side) {
  Slit slit;
  for (int k = 0; k < 16; ++k) slit.open(on_arc(radians(10 * k)), on_arc(radians(10 * (k + 1))), 0.001);
  const Vec3 outwards = on_arc(radians(160)).at(0.5).normalized();
  const std::vector<Vec3> facing = slit.facing(outwards, 0.005);
  for (double degrees = 5; degrees < 160; degrees += 10) {
    const Vec3 on = on_arc(radians(degrees)).at(0.5);
    const auto within = slit.plane_facing(0.95 * on, 0.005, facing),
               beyond = slit.plane_facing(1.05 * on, 0.005, facing);
    ASSERT_TRUE(within && beyond) << degrees;
    EXPECT_LT(within->height_m(0.95 * on), 0) << degrees;
    EXPECT_GT(beyond->height_m(1.05 * on), 0) << degrees;
  }
}

// Three sides of a square, in strips of 2 mm; the blade turns at once at two corners.
TEST(Slit, around_sharp_corners_has_one_inner_side) {
  const Vec3 corners[] = {{0, 0, 0}, {0.02, 0, 0}, {0.02, 0.02, 0}, {0, 0.02, 0}};
  const auto upright = [](const Vec3& at) { return BladeEdge{at - Vec3(0, 0, 0.02), at + Vec3(0, 0, 0.02)}; };
  Slit slit;
  for (int side = 0; side < 3; ++side)
    for (int k = 0; k < 10; ++k) {
      const Vec3 way_m = 0.1 * (corners[side + 1] - corners[side]), from = corners[side] + k * way_m;
      slit.open(upright(from), upright(from + way_m), 0.001);
    }
  const std::vector<Vec3> facing = slit.facing(-Vec3::UnitY(), 0.004);
  const Vec3 middle(0.01, 0.01, 0);
  for (int side = 0; side < 3; ++side)
    for (const double share : {0.05, 0.5, 0.95}) {
      const Vec3 on = corners[side] + share * (corners[side + 1] - corners[side]);
      const Vec3 inside = on + 0.0005 * (middle - on).normalized();
      const auto plane = slit.plane_facing(inside, 0.004, facing);
      ASSERT_TRUE(plane) << side << ' ' << share;
      EXPECT_GT(plane->height_m(inside), 0) << side << ' ' << share;
    }
  for (const int corner : {1, 2}) {
    const Vec3 wedge = corners[corner] - 0.001 * (middle - corners[corner]).normalized();
    const auto plane = slit.plane_facing(wedge, 0.004, facing);
    ASSERT_TRUE(plane) << "outside the corner, before neither of its sides";
    EXPECT_NEAR(plane->height_m(wedge), -0.001, 1e-9);
  }
  EXPECT_FALSE(slit.plane_facing(corners[3] - Vec3(0.001, 0, 0), 0.004, facing)) << "ahead of its end";
}

TEST(Slit, another_cut_far_from_its_beginning_counts_only_along_its_end) {
  Slit slit;
  slit.open({Vec3(0.1, -0.02, -0.02), Vec3(0.1, -0.02, 0.02)}, {Vec3(0.1, 0.02, -0.02), Vec3(0.1, 0.02, 0.02)}, 0);
  slit.open({Vec3(0, 0, -0.02), Vec3(0, 0, 0.02)}, {Vec3(0.05, 0, -0.02), Vec3(0.05, 0, 0.02)}, 0);
  const std::vector<Vec3> facing = slit.facing(Vec3::UnitY(), 0.005);
  EXPECT_TRUE(slit.plane_facing(Vec3(0.02, 0.001, 0), 0.005, facing));
  EXPECT_FALSE(slit.plane_facing(Vec3(0.101, 0.001, 0), 0.005, facing));
}

}  // namespace
}  // namespace sectio::volume_test

#include "sim_server/world/stuck_points.h"

#include <gtest/gtest.h>

namespace sectio::simulation_test {
namespace {

const StuckPoints::Contact kOne{0, 1, 0, 7}, kOther{0, 1, 1, 3};
const StuckPoints::OnTriangle kOn{{1, 2, 3}, Vec3(0.5, 0.5, 0)};
const Vec3 kUp = Vec3::UnitZ();

// A vertex whose way from any place on the other side is this.
Vec3 slide(StuckPoints& stuck, const StuckPoints::Contact& contact, const Vec3& way, double most) {
  return stuck.slide(
      contact, kOn, [&](const StuckPoints::OnTriangle&) { return way; }, kUp, most);
}

TEST(StuckPoints, remember_how_far_they_have_slid_along_the_surface_since_they_met) {
  StuckPoints stuck;
  EXPECT_EQ(slide(stuck, kOne, Vec3(5, 0, 0), 10), Vec3::Zero()) << "they meet here";
  stuck.end_step();
  EXPECT_EQ(slide(stuck, kOne, Vec3(6, 0, 5), 10), Vec3(1, 0, 0));
  EXPECT_EQ(slide(stuck, kOther, Vec3(0, 0, 0), 10), Vec3::Zero());
  stuck.end_step();
  EXPECT_EQ(slide(stuck, kOne, Vec3(7, 0, 5), 10), Vec3(2, 0, 0));
  EXPECT_EQ(slide(stuck, kOther, Vec3(0, 1, 0), 10), Vec3(0, 1, 0));
}

TEST(StuckPoints, slip_beyond_the_most_that_friction_bears) {
  StuckPoints stuck;
  slide(stuck, kOne, Vec3::Zero(), 1);
  stuck.end_step();
  EXPECT_EQ(slide(stuck, kOne, Vec3(3, 0, 0), 1), Vec3(1, 0, 0));
  stuck.end_step();
  EXPECT_EQ(slide(stuck, kOne, Vec3(2.5, 0, 0), 1), Vec3(0.5, 0, 0)) << "back from where they slipped to";
}

TEST(StuckPoints, are_followed_from_triangle_to_triangle) {
  StuckPoints stuck;
  const auto way = [](const StuckPoints::OnTriangle& from) { return Vec3(from.v[0] == 9 ? 4 : 1, 0, 0); };
  stuck.slide(kOne, kOn, way, kUp, 10);
  stuck.end_step();
  const StuckPoints::OnTriangle next{{9, 2, 3}, Vec3(1, 0, 0)};
  EXPECT_EQ(stuck.slide(kOne, next, way, kUp, 10), Vec3::Zero()) << "it lies on another one, and has not moved";
  stuck.end_step();
  const auto moved = [&](const StuckPoints::OnTriangle& from) { return Vec3(way(from) + Vec3(0, 2, 0)); };
  EXPECT_EQ(stuck.slide(kOne, next, moved, kUp, 10), Vec3(0, 2, 0));
}

TEST(StuckPoints, forget_points_that_part) {
  StuckPoints stuck;
  slide(stuck, kOne, Vec3::Zero(), 1);
  stuck.end_step();
  EXPECT_EQ(slide(stuck, kOne, Vec3(1, 0, 0), -0.1), Vec3::Zero()) << "a gap";
  stuck.end_step();
  EXPECT_EQ(slide(stuck, kOne, Vec3(1, 0, 0), 1), Vec3::Zero());
}

}  // namespace
}  // namespace sectio::simulation_test

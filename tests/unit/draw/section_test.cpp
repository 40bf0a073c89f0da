// A section leaves out the tissue on one side of a plane, and shows what is inside.
#include <gtest/gtest.h>

#include "render_client/draw/draw_frame.h"
#include "tests/unit/draw/drawn.h"
#include "tests/unit/draw/picture_difference.h"
#include "tests/unit/draw/test_organ.h"

namespace sectio::draw_test {
namespace {

Image cut_open(const Frame& frame, const SectionPlane& section) {
  return test::drawn(frame, {.overlay = false, .section = section});
}

// How many pixels are rather blue.
int blue_pixels(const Image& image) {
  int count = 0;
  for (std::size_t i = 0; i + 3 < image.rgba.size(); i += 4)
    count += image.rgba[i + 2] > 2 * image.rgba[i] && image.rgba[i + 2] > 60 ? 1 : 0;
  return count;
}

TEST(Section, shows_the_region_inside_that_the_skin_hides) {
  Frame frame = test::make_frame({.opening_m = 0});
  Region& region = frame.bodies[0].regions.emplace_back();
  region.colour = region.grain_colour = Vec3(0, 0, 1);
  region.parts = {{RegionForm::ellipsoid, Vec3(0, 0, 0), Vec3::Constant(0.01)}};
  EXPECT_EQ(blue_pixels(test::drawn(frame)), 0);
  SectionPlane plane = section_at_target(frame.camera);
  plane.point_world_m.setZero();
  const int in_the_middle = blue_pixels(cut_open(frame, plane));
  EXPECT_GT(in_the_middle, 100);
  plane.point_world_m -= 0.012 * plane.normal_world;
  EXPECT_EQ(blue_pixels(cut_open(frame, plane)), 0) << "behind the region";
  // The whole body is carried away and turned, and so is the region in it.
  plane.point_world_m.setZero();
  const Eigen::AngleAxisf turn(0.7f, Vec3f(1, 2, 3).normalized());
  for (Vec3f& place : frame.bodies[0].positions_world_m) place = turn * place;
  EXPECT_NEAR(blue_pixels(cut_open(frame, plane)), in_the_middle, 0.1 * in_the_middle) << "a ball in the middle";
}

TEST(Section, leaves_out_nothing_or_all) {
  Frame frame = test::make_frame();
  const Image plain = test::drawn(frame);
  SectionPlane plane = section_at_target(frame.camera);
  plane.point_world_m += 0.1 * plane.normal_world;
  EXPECT_EQ(test::pixels_that_differ(plain, cut_open(frame, plane), 8), 0) << "in front of the body";
  plane.point_world_m -= 0.25 * plane.normal_world;
  const Image without = cut_open(frame, plane);
  frame.bodies.clear();
  EXPECT_EQ(test::pixels_that_differ(without, test::drawn(frame), 0), 0) << "behind it";
}

}  // namespace
}  // namespace sectio::draw_test

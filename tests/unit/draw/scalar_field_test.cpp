// Scalar fields of vertices, as pixels: wetness as gloss, any other field in colours.
#include <gtest/gtest.h>

#include <limits>

#include "render_client/draw/colour_map.h"
#include "render_client/draw/draw_frame.h"
#include "tests/unit/draw/drawn.h"
#include "tests/unit/draw/picture_difference.h"
#include "tests/unit/draw/test_organ.h"

namespace sectio::draw_test {
namespace {

// From above, so that x runs from left to right through the middle row.
Frame seen_along_z() {
  Frame frame = test::make_frame({.opening_m = 0});
  frame.camera.eye_world_m = Vec3(0, -0.02, 0.3);
  frame.camera.target_world_m = Vec3::Zero();
  return frame;
}

// The field of a body that grows along x from `least` at -80 mm to `most` at 80 mm.
ScalarField along_x(const BodyFrame& body, const char* name, float least, float most) {
  ScalarField field{name, least, most, {}};
  for (const Vec3f& rest : body.rest_body_m)
    field.values.push_back(least + (most - least) * (rest.x() + 0.08f) / 0.16f);
  return field;
}

double mean_light(const Image& image, int x_from, int x_to) {
  double sum = 0;
  for (int y = 0; y < test::kHeight; ++y)
    for (int x = x_from; x < x_to; ++x) sum += image.pixel(x, y)[0] + image.pixel(x, y)[1] + image.pixel(x, y)[2];
  return sum / (3.0 * test::kHeight * (x_to - x_from));
}

int bright_pixels(const Image& image) {
  int count = 0;
  for (int y = 0; y < test::kHeight; ++y)
    for (int x = 0; x < test::kWidth; ++x) count += image.pixel(x, y)[2] > 200;
  return count;
}

TEST(ScalarFields, wet_tissue_is_darker_and_shines) {
  Frame frame = seen_along_z();
  const Image dry = test::drawn(frame);
  frame.bodies[0].scalars = {{"wetness", 0, 1, std::vector<float>(frame.bodies[0].rest_body_m.size(), 0.0f)}};
  EXPECT_EQ(test::pixels_that_differ(dry, test::drawn(frame), 0), 0) << "a wetness of 0 is dry";
  frame.bodies[0].scalars[0].values.assign(frame.bodies[0].rest_body_m.size(), 1.0f);
  const Image wet = test::drawn(frame);
  EXPECT_LT(mean_light(wet, 0, test::kWidth), mean_light(dry, 0, test::kWidth) - 1);
  EXPECT_GT(bright_pixels(wet), bright_pixels(dry) + 100);
}

TEST(ScalarFields, wetness_is_seen_where_it_is) {
  Frame frame = seen_along_z();
  const Image dry = test::drawn(frame);
  std::vector<float> left_half;
  for (const Vec3f& rest : frame.bodies[0].rest_body_m) left_half.push_back(rest.x() < -0.01f ? 1.0f : 0.0f);
  frame.bodies[0].scalars = {{"wetness", 0, 1, left_half}};
  const Image wet = test::drawn(frame);
  int left = 0, right = 0;
  for (int y = 0; y < test::kHeight; ++y)
    for (int x = 0; x < test::kWidth; ++x)
      (x < test::kWidth / 2 ? left : right) += test::difference(dry, wet, x, y) > 3;
  EXPECT_GT(left, 5000);
  EXPECT_EQ(right, 0);
}

TEST(ScalarFields, the_field_that_is_asked_for_is_shown_in_the_colours_of_its_range) {
  Frame frame = seen_along_z();
  frame.bodies[0].scalars = {along_x(frame.bodies[0], "temperature", 36, 90)};
  const Image image = test::drawn(frame, {.overlay = false, .field = "temperature"});
  // Light dims a colour and keeps its hue.
  const auto hue_at = [&](const Image& picture, double x_m) {
    const Eigen::Vector4f clip = projection(frame.camera, static_cast<double>(test::kWidth) / test::kHeight) *
                                 view_from_world(frame.camera) * Eigen::Vector4f(static_cast<float>(x_m), 0, 0.03f, 1);
    const int x = static_cast<int>((clip.x() / clip.w() + 1) / 2 * test::kWidth);
    const int y = static_cast<int>((1 - clip.y() / clip.w()) / 2 * test::kHeight);
    const std::uint8_t* p = picture.pixel(x, y);
    return Vec3(Vec3(p[0], p[1], p[2]).normalized());
  };
  for (const double x_m : {-0.06, -0.03, 0.0, 0.03, 0.06}) {
    const Colour c = map_colour(static_cast<float>((x_m + 0.08) / 0.16));
    EXPECT_LT((hue_at(image, x_m) - Vec3(c.r, c.g, c.b).normalized()).norm(), 0.06) << x_m;
  }
  frame.bodies.push_back(frame.bodies[0]);
  for (Vec3f& p : frame.bodies[1].positions_world_m) p.z() -= 1;  // out of sight
  frame.bodies[1].scalars[0].most = 144;
  const Colour half = map_colour(0.25f);
  const Image of_two = test::drawn(frame, {.overlay = false, .field = "temperature"});
  EXPECT_LT((hue_at(of_two, 0.0) - Vec3(half.r, half.g, half.b).normalized()).norm(), 0.06)
      << "bodies share one range, 36 to 144";
}

TEST(ScalarFields, a_field_that_no_body_has_changes_the_overlay_only) {
  Frame frame = seen_along_z();
  frame.bodies[0].scalars = {along_x(frame.bodies[0], "temperature", 36, 90)};
  const Image tissue = test::drawn(frame);
  EXPECT_EQ(test::pixels_that_differ(tissue, test::drawn(frame, {.overlay = false, .field = "damage"}), 0), 0);
  EXPECT_GT(test::pixels_that_differ(test::drawn(frame, {}), test::drawn(frame, {.field = "damage"}), 50), 100)
      << "it says so";
}

TEST(ScalarFields, a_legend_shows_the_colours_from_end_to_end) {
  Image image(300, 80, {0, 0, 0, 255});
  draw_legend(image, Text(14), "temperature", {36, 90});
  for (const float share : {0.0f, 0.5f, 1.0f}) {
    const Colour c = map_colour(share);
    bool found = false;
    for (int x = 0; x < image.width_px && !found; ++x)
      for (int y = 0; y < image.height_px && !found; ++y) {
        const std::uint8_t* p = image.pixel(x, y);
        found = std::abs(p[0] - c.r) + std::abs(p[1] - c.g) + std::abs(p[2] - c.b) < 6;
      }
    EXPECT_TRUE(found) << share;
  }
}

TEST(ScalarFields, values_beyond_the_range_are_clamped_and_missing_ones_are_the_least) {
  Frame frame = seen_along_z();
  const std::size_t slots = frame.bodies[0].rest_body_m.size();
  const DrawOptions shown{.overlay = false, .field = "damage"};
  const auto with = [&](std::vector<float> values) {
    frame.bodies[0].scalars = {{"damage", 0, 1, std::move(values)}};
    return test::drawn(frame, shown);
  };
  const Image least = with(std::vector<float>(slots, 0.0f)), most = with(std::vector<float>(slots, 1.0f));
  EXPECT_GT(test::pixels_that_differ(least, most, 30), 5000);
  EXPECT_EQ(test::pixels_that_differ(most, with(std::vector<float>(slots, 7.0f)), 0), 0);
  EXPECT_EQ(test::pixels_that_differ(least, with(std::vector<float>(slots, -7.0f)), 0), 0);
  EXPECT_EQ(test::pixels_that_differ(least, with({}), 0), 0);
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(test::pixels_that_differ(least, with(std::vector<float>(slots, kNan)), 0), 0);
}

TEST(ColourMap, grows_in_lightness_from_blue_to_yellow) {
  int lightness = 0;
  for (int i = 0; i <= 20; ++i) {
    const Colour c = map_colour(static_cast<float>(i) / 20);
    const int now = 2 * c.r + 7 * c.g + c.b;
    EXPECT_GT(now, lightness);
    lightness = now;
  }
  const Colour low = map_colour(-1), high = map_colour(2);
  EXPECT_GT(low.b, low.g + 50);
  EXPECT_GT(high.r, high.b + 150);
}

}  // namespace
}  // namespace sectio::draw_test

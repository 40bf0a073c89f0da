#include "render_client/draw/draw_frame.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>
#include <map>
#include <utility>

#include "render_client/draw/camera.h"
#include "tests/support/shapes.h"
#include "tests/unit/draw/drawn.h"
#include "tests/unit/draw/picture_difference.h"
#include "tests/unit/draw/test_organ.h"

namespace sectio::draw_test {
namespace {

using test::difference;
using test::drawn;
using test::kHeight;
using test::kWidth;
using test::pixels_that_differ;
using test::shared_canvas;

// The place of a point of the world in the picture.
std::pair<int, int> pixel_of(const Camera& camera, const Vec3& p_world_m) {
  const Eigen::Vector4f clip = projection(camera, static_cast<double>(kWidth) / kHeight) * view_from_world(camera) *
                               p_world_m.cast<float>().homogeneous();
  const Eigen::Vector2f ndc = clip.head<2>() / clip.w();
  return {static_cast<int>((ndc.x() + 1) * 0.5f * kWidth), static_cast<int>((1 - ndc.y()) * 0.5f * kHeight)};
}

Frame seen_from_above() {
  Frame frame = test::make_frame();
  frame.camera.eye_world_m = Vec3(0, -0.02, 0.25);
  frame.camera.target_world_m = Vec3(0, 0, 0.03);
  return frame;
}

TEST(TestOrgan, is_closed_and_oriented) {
  std::map<std::pair<VertexId, VertexId>, int> edges;
  for (const Triangle& t : test::make_organ().triangles) {
    for (std::size_t i = 0; i < 3; ++i) ++edges[{t.v[i], t.v[(i + 1) % 3]}];
  }
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_TRUE(edges.contains({edge.second, edge.first}));
  }
}

TEST(DrawFrame, skin_wall_and_background_look_different) {
  const Frame frame = seen_from_above();
  const Image image = drawn(frame);
  const auto [wall_x, wall_y] = pixel_of(frame.camera, Vec3(0, 0.003, 0.028));
  const auto [skin_x, skin_y] = pixel_of(frame.camera, Vec3(-0.06, 0, 0.024));
  const std::uint8_t* wall = image.pixel(wall_x, wall_y);
  const std::uint8_t* skin = image.pixel(skin_x, skin_y);
  const std::uint8_t* background = image.pixel(3, kHeight / 2);
  EXPECT_GT(skin[0], skin[1] + 20) << "skin is red";
  EXPECT_GT(wall[0], wall[1] + 20) << "walls are red";
  EXPECT_LT(std::abs(background[0] - background[1]), 20) << "the background is neutral";
  EXPECT_LT(std::abs(background[1] - background[2]), 20) << "the background is neutral";
  EXPECT_LT(wall[1] + wall[0], skin[1] + skin[0] - 20) << "walls get less light than skin";
}

TEST(DrawFrame, moved_rigidly_with_the_camera_it_looks_the_same) {
  const Frame before = seen_from_above();
  Frame after = before;
  Pose motion;
  motion.position_m = Vec3(0.3, -0.2, 0.1);
  motion.orientation = Eigen::AngleAxisd(1.1, Vec3(1, 2, -1).normalized());
  for (Vec3f& p : after.bodies[0].positions_world_m) p = motion.to_world(p.cast<double>()).cast<float>();
  after.camera.eye_world_m = motion.to_world(before.camera.eye_world_m);
  after.camera.target_world_m = motion.to_world(before.camera.target_world_m);
  after.camera.up_world = motion.orientation * before.camera.up_world;
  const Image a = drawn(before), b = drawn(after);
  // Rounding moves outlines by a pixel here and there; the pattern of skin and walls must not move.
  EXPECT_LT(pixels_that_differ(a, b, 6), kWidth * kHeight / 200);
  const auto [x, y] = pixel_of(before.camera, Vec3(0, 0.003, 0.028));
  EXPECT_LE(difference(a, b, x, y), 4);
}

TEST(DrawFrame, pattern_sticks_to_rest_coordinates) {
  const Frame before = seen_from_above();
  Frame after = before;
  for (Vec3f& p : after.bodies[0].rest_body_m) p += Vec3f(0.013f, 0.007f, 0.004f);
  EXPECT_GT(pixels_that_differ(drawn(before), drawn(after), 6), 500);
}

TEST(DrawFrame, overlay_changes_its_panel_only) {
  const Frame frame = test::make_frame();
  const Image plain = drawn(frame), labelled = drawn(frame, {.frames_per_s = 30});
  int changed = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (difference(plain, labelled, x, y) == 0) continue;
      ++changed;
      ASSERT_TRUE(x < 400 && y < 60) << x << ", " << y;
    }
  }
  EXPECT_GT(changed, 500);
}

// The backdrop of shaders.h, by place in the picture, -1 to 1.
Vec3 backdrop(double x, double y) {
  const double dx = 0.62 * x + 0.06, dy = 0.55 * y - 0.18;
  const double light = std::max(1 - dx * dx - dy * dy, 0.0);
  return Vec3(0.085, 0.10, 0.115) + light * light * (Vec3(0.36, 0.40, 0.43) - Vec3(0.085, 0.10, 0.115));
}

TEST(DrawFrame, an_empty_frame_is_the_backdrop_in_every_pixel) {
  const Image image = drawn(Frame{});
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const std::uint8_t* p = image.pixel(x, y);
      const Vec3 expected = 255 * backdrop((2 * x + 1.0) / kWidth - 1, 1 - (2 * y + 1.0) / kHeight);
      const Vec3 difference = Vec3(p[0], p[1], p[2]) - expected;
      ASSERT_LT(difference.cwiseAbs().maxCoeff(), 1.1) << x << ", " << y << ": half a level of grain, half of rounding";
      ASSERT_EQ(p[3], 255);
    }
}

TEST(DrawFrame, bodies_that_are_not_finite_are_left_out) {
  Frame frame = test::make_frame();
  frame.bodies[0].positions_world_m[100].x() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(pixels_that_differ(drawn(frame), drawn(Frame{}), 0), 0);
  frame = test::make_frame();
  frame.bodies[0].positions_world_m.resize(10);
  EXPECT_EQ(pixels_that_differ(drawn(frame), drawn(Frame{}), 0), 0);
  frame = test::make_frame();
  frame.bodies[0].positions_world_m[100] *= 1e30f;
  drawn(frame);
  frame.camera.eye_world_m = frame.camera.target_world_m;
  drawn(frame);
}

TEST(DrawFrame, same_frame_twice_is_the_same_picture) {
  Frame frame = test::make_frame();
  frame.tools.push_back(test::make_scalpel_at(Vec3(0, 0, 0.03)));
  FramePainter painter(shared_canvas());
  const Image first = painter.draw_frame(frame), second = painter.draw_frame(frame);
  EXPECT_EQ(first.rgba, second.rgba);
}

TEST(DrawFrame, new_revision_brings_new_triangles) {
  Frame frame = seen_from_above();
  FramePainter painter(shared_canvas());
  const Image open = painter.draw_frame(frame, {.overlay = false});
  frame.bodies[0] = test::make_organ({.opening_m = 0});
  frame.bodies[0].revision = 2;
  const Image closed = painter.draw_frame(frame, {.overlay = false});
  EXPECT_GT(pixels_that_differ(open, closed, 10), 500);
  EXPECT_EQ(pixels_that_differ(closed, drawn(frame), 0), 0) << "the same as a fresh painter draws";
}

TEST(DrawFrame, another_arrangement_brings_bodies_of_the_same_names_and_revisions) {
  Frame frame = seen_from_above();
  FramePainter painter(shared_canvas());
  painter.draw_frame(frame, {.overlay = false});
  frame.bodies[0].regions.push_back({});
  Region& tumour = frame.bodies[0].regions.back();
  tumour.parts = {{RegionForm::ellipsoid, Vec3(0, 0, 0.03), Vec3(0.02, 0.02, 0.02)}};
  tumour.colour = Vec3::UnitY();
  const Image same = painter.draw_frame(frame, {.overlay = false});
  ++frame.arrangement;
  const Image after = painter.draw_frame(frame, {.overlay = false});
  EXPECT_GT(pixels_that_differ(same, after, 10), 500);
  EXPECT_EQ(pixels_that_differ(after, drawn(frame), 0), 0) << "the same as a fresh painter draws";
}

TEST(DrawFrame, instruments_are_drawn_when_present) {
  Frame frame = test::make_frame();
  const Image without = drawn(frame);
  for (const char* kind :
       {"scalpel", "cautery_hook", "knife", "scissors", "medical_scissors", "forceps", "probe", "something else"}) {
    frame.tools = {test::make_scalpel_at(Vec3(0, 0, 0.03))};
    frame.tools[0].kind = kind;
    frame.tools[0].gauge_m = 0.008;
    EXPECT_GT(pixels_that_differ(without, drawn(frame), 10), 400) << kind;
    frame.tools[0].abcd_tool_m.fill(Vec3::Zero());
    drawn(frame);
    frame.tools[0].present = false;
    EXPECT_EQ(pixels_that_differ(without, drawn(frame), 0), 0) << kind;
  }
}

TEST(DrawFrame, blades_are_drawn_as_far_apart_as_they_are) {
  Frame frame = test::make_frame();
  frame.tools = {test::make_scalpel_at(Vec3(0, 0, 0.03))};
  frame.tools[0].kind = "scissors";
  frame.tools[0].abcd_tool_m = {Vec3::Zero(), Vec3(-0.1, 0, 0.03), Vec3(-0.04, 0, 0.01), Vec3(0, 0, -0.004)};
  const Image closed = drawn(frame);
  frame.tools[0].pose_world.opening_rad = 0.6;
  EXPECT_GT(pixels_that_differ(closed, drawn(frame), 10), 100);
}

TEST(DrawFrame, a_floor_lies_beneath_and_is_darker_under_what_lies_on_it) {
  Frame frame = seen_from_above();
  const Image without = drawn(frame);
  frame.floor_z_m = -0.05;
  const Image far = drawn(frame);
  const auto [x, y] = pixel_of(frame.camera, Vec3(0, 0, 0.03));
  EXPECT_EQ(difference(without, far, x, y), 0) << "the body is in front of it";
  EXPECT_GT(pixels_that_differ(without, far, 10), 5000);
  frame.floor_z_m = 0.0;
  EXPECT_GT(pixels_that_differ(far, drawn(frame), 10), 1000) << "shade";
  frame.camera.eye_world_m.z() = -0.3;
  const Image from_below = drawn(frame);
  frame.floor_z_m.reset();
  EXPECT_EQ(pixels_that_differ(from_below, drawn(frame), 0), 0) << "nobody looks from under it";
}

TEST(DrawFrame, wireframe_adds_dark_lines) {
  const Frame frame = test::make_frame();
  const Image plain = drawn(frame), lines = drawn(frame, {.wireframe = true, .overlay = false});
  EXPECT_GT(pixels_that_differ(plain, lines, 10), 2000);
  for (std::size_t i = 0; i < plain.rgba.size(); ++i) ASSERT_LE(lines.rgba[i], std::max<int>(plain.rgba[i], 13));
}

TEST(DrawFrame, four_samples_smooth_the_outline) {
  const std::unique_ptr<Canvas> canvas = make_osmesa_canvas(kWidth, kHeight, 4);
  FramePainter painter(*canvas);
  const Frame frame = test::make_frame();
  const Image smooth = painter.draw_frame(frame, {.overlay = false});
  const int changed = pixels_that_differ(smooth, drawn(frame), 10);
  EXPECT_GT(changed, 100);
  EXPECT_LT(changed, kWidth * kHeight / 15);
}

// A small ball on the line of sight, so far from the eyes.
Frame ball_at(double distance_m) {
  Frame frame;
  frame.camera = {Vec3(0, 0, 0), Vec3(0.4, 0, 0), Vec3::UnitZ(), 40};
  BodyFrame& ball = frame.bodies.emplace_back();
  const TriangleSoup soup = test::ellipsoid(3, Vec3::Constant(0.006));
  for (const Vec3& v : soup.vertices_body_m) {
    ball.rest_body_m.push_back(v.cast<float>());
    ball.positions_world_m.push_back((v + Vec3(distance_m, 0, 0)).cast<float>());
  }
  for (const auto& t : soup.triangles) ball.triangles.push_back({t, Surface::skin});
  return frame;
}

// Mean column of the pixels of one half that a ball changes, and their mean row.
Eigen::Vector2d centre_in_half(const Image& image, const Image& empty, int half) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  int count = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      if (difference(image, empty, half * kWidth + x, y) > 8) sum += Eigen::Vector2d(x, y), ++count;
  EXPECT_GT(count, 20);
  return sum / count;
}

TEST(C_EXP, C_EXP_2_points_beside_the_convergence_distance_have_the_disparity_of_their_depth) {
  const Stereo eyes{.eye_separation_m = 0.02, .convergence_m = 0.4};
  const DrawOptions options{.overlay = false, .stereo = eyes};
  const std::unique_ptr<Canvas> canvas = make_osmesa_canvas(2 * kWidth, kHeight);
  FramePainter painter(*canvas);
  Frame nothing = ball_at(0.4);
  nothing.bodies.clear();
  const Image empty = painter.draw_frame(nothing, options);
  const double per_slope = kHeight / (2 * std::tan(20 * M_PI / 180));  // pixels
  for (const double distance_m : {0.4, 0.3, 0.6}) {
    const Image& pair = painter.draw_frame(ball_at(distance_m), options);
    const Eigen::Vector2d left = centre_in_half(pair, empty, 0), right = centre_in_half(pair, empty, 1);
    const double crossed = per_slope * 0.02 * (1 / distance_m - 1 / 0.4);
    EXPECT_NEAR(left.x() - right.x(), crossed, 0.5) << distance_m << " m away";
    EXPECT_NEAR(left.y(), right.y(), 0.2) << "off-axis, not toed in";
  }
}

TEST(C_EXP, C_EXP_2_by_default_the_convergence_distance_is_the_target) {
  const Camera camera{Vec3(0, 0, 0), Vec3(0.3, 0, 0), Vec3::UnitZ(), 40};
  for (const int side : {-1, 1}) {
    const EyeView eye = eye_view(camera, 1.5, {}, side);
    // A point on the plane of the target has no disparity: an eye in the middle sees it at the same place.
    const Eigen::Vector4f p(0.3f, 0.05f, -0.02f, 1);
    const Eigen::Vector4f seen = eye.projection * eye.view_from_world * p;
    const Eigen::Vector4f middle = projection(camera, 1.5) * view_from_world(camera) * p;
    EXPECT_LT((seen / seen.w() - middle / middle.w()).norm(), 1e-5);
    EXPECT_NEAR(eye.view_from_world(0, 3), -side * 0.005, 1e-6);
  }
}

TEST(Camera, fit_shows_all_of_the_body) {
  Frame frame = test::make_frame();
  frame.camera.eye_world_m = Vec3(2, 1, 3);
  frame.camera.target_world_m = Vec3(1, 1, 1);
  const Camera camera = fit_camera(frame, static_cast<double>(kWidth) / kHeight);
  int low_x = kWidth, high_x = 0, low_y = kHeight, high_y = 0;
  for (const Vec3f& p : frame.bodies[0].positions_world_m) {
    const auto [x, y] = pixel_of(camera, p.cast<double>());
    low_x = std::min(low_x, x), high_x = std::max(high_x, x), low_y = std::min(low_y, y), high_y = std::max(high_y, y);
  }
  EXPECT_GE(low_x, 0);
  EXPECT_LT(high_x, kWidth);
  EXPECT_GE(low_y, 0);
  EXPECT_LT(high_y, kHeight);
  EXPECT_TRUE(high_x - low_x > 0.8 * kWidth || high_y - low_y > 0.8 * kHeight);
}

TEST(Canvas, sizes_that_cannot_be_drawn_are_refused) {
  EXPECT_THROW(make_osmesa_canvas(0, 100), std::runtime_error);
  EXPECT_THROW(make_osmesa_canvas(100, 100, 3), std::runtime_error);
}

}  // namespace
}  // namespace sectio::draw_test

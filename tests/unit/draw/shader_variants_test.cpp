// Variants of the shaders leave out work, never anything that is seen.
#include <gtest/gtest.h>

#include "render_client/draw/body_mesh.h"
#include "render_client/draw/draw_frame.h"
#include "render_client/draw/orbit_camera.h"
#include "render_client/draw/shadow_split.h"
#include "render_client/draw/tissue_noise.h"
#include "tests/unit/draw/drawn.h"
#include "tests/unit/draw/picture_difference.h"
#include "tests/unit/draw/test_organ.h"

namespace sectio::draw_test {
namespace {

constexpr test::OrganShape kFine{.rings = 80, .around = 160, .opening_m = 0};

ToolFrame scalpel_behind_the_camera() {
  return test::make_scalpel_at(Vec3(0, 0, 5));
}

TEST(ShaderVariants, regions_that_no_pixel_shows_change_no_pixel) {
  Frame frame = test::make_frame(kFine);
  const Image plain = test::drawn(frame);
  Region& region = frame.bodies[0].regions.emplace_back();
  region.colour = Vec3(0, 0, 1);
  region.parts = {{RegionForm::ellipsoid, Vec3(0, 0, 0), Vec3::Constant(0.01)}};
  EXPECT_EQ(test::pixels_that_differ(plain, test::drawn(frame), 0), 0) << "the region lies deep inside";
  region.parts[0].b_m = Vec3::Constant(0.06);
  EXPECT_GT(test::pixels_that_differ(plain, test::drawn(frame), 30), 1000) << "the region reaches the skin";
}

TEST(ShaderVariants, an_instrument_that_shades_nothing_changes_no_pixel) {
  Frame frame = test::make_frame();
  frame.floor_z_m = -0.04;
  const Image plain = test::drawn(frame);
  frame.tools = {scalpel_behind_the_camera()};
  EXPECT_EQ(test::pixels_that_differ(plain, test::drawn(frame), 0), 0) << "skin, walls and drape";
  frame.tools[0].pose_world.position_m = Vec3(0, 0.02, 0.05);
  EXPECT_GT(test::pixels_that_differ(plain, test::drawn(frame), 10), 400);
}

// A frame from several sides, by the shaders that each triangle needs, and all of it by those with shadows.
TEST(ShaderVariants, triangles_that_no_shadow_reaches_are_drawn_without_and_change_no_pixel) {
  CanvasView view;
  view.occluder_count = 2;
  const BodyFrame body = test::make_organ(kFine);
  BodyMesh mesh;
  mesh.arrange(body);
  ASSERT_TRUE(mesh.move(body));
  Canvas& canvas = test::shared_canvas();
  const MeshId id = canvas.add_mesh();
  canvas.set_vertices(id, mesh.vertices());
  for (const double turn_rad : {0.0, 2.0, 4.0}) {
    OrbitCamera camera(test::make_frame().camera);
    camera.orbit(turn_rad, 0.1);
    view.view_from_world = view_from_world(camera.camera());
    view.projection = projection(camera.camera(), static_cast<double>(test::kWidth) / test::kHeight);
    view.occluders = {Occluder{Vec3f(0, 0, 0.03f), Vec3f(0.03f, 0.02f, 0.12f), 0.002f, 0.004f},
                      Occluder{Vec3f(-0.03f, 0.01f, 0.05f), Vec3f(-0.03f, 0.01f, 0.15f), 0.001f, 0.003f}};
    ShadowSplit split;
    split.look(view, mesh.vertices());
    const ShadowSplit::Parts skin = split.append(mesh.indices(), mesh.skin());
    canvas.set_indices(id, split.indices());
    const auto drawn = [&](bool divided) {
      Material material{.shading = Shading::skin, .colour = body.skin_colour.cast<float>(), .lit = divided};
      canvas.begin(view);
      canvas.draw(id, skin.lit, material, Eigen::Matrix4f::Identity());
      material.lit = false;
      canvas.draw(id, skin.shadowed, material, Eigen::Matrix4f::Identity());
      return canvas.finish();
    };
    const Image with_shadows = drawn(false);
    EXPECT_EQ(test::pixels_that_differ(with_shadows, drawn(true), 0), 0) << turn_rad;
    view.occluder_count = 0;
    EXPECT_GT(test::pixels_that_differ(with_shadows, drawn(false), 10), 200) << "there are shadows";
    view.occluder_count = 2;
    EXPECT_GT(skin.lit.count, mesh.skin().count / 2) << "most of it is in the light";
  }
  canvas.remove_mesh(id);
}

// Skin of the organ, drawn with either way to the broad pattern.
Image skin(const BodyFrame& body, bool pattern_per_pixel) {
  Canvas& canvas = test::shared_canvas();
  BodyMesh mesh;
  mesh.arrange(body);
  EXPECT_TRUE(mesh.move(body));
  const MeshId id = canvas.add_mesh();
  canvas.set_indices(id, mesh.indices());
  canvas.set_vertices(id, mesh.vertices());
  CanvasView view;
  const Camera camera = test::make_frame().camera;
  view.view_from_world = view_from_world(camera);
  view.projection = projection(camera, static_cast<double>(test::kWidth) / test::kHeight);
  canvas.begin(view);
  canvas.draw(id, mesh.skin(), {Shading::skin, body.skin_colour.cast<float>(), pattern_per_pixel},
              Eigen::Matrix4f::Identity());
  Image image = canvas.finish();
  canvas.remove_mesh(id);
  return image;
}

TEST(ShaderVariants, vertices_of_a_fine_mesh_carry_the_broad_pattern) {
  const BodyFrame body = test::make_organ(kFine);
  BodyMesh mesh;
  mesh.arrange(body);
  ASSERT_FALSE(mesh.is_coarse());
  const Image per_pixel = skin(body, true), per_vertex = skin(body, false);
  EXPECT_LT(test::mean_difference(per_pixel, per_vertex), 0.5) << "levels of 255";
  EXPECT_LT(test::pixels_that_differ(per_pixel, per_vertex, 8), test::kWidth * test::kHeight / 200);
  EXPECT_LT(test::pixels_that_differ(per_pixel, per_vertex, 20), 1);
}

TEST(ShaderVariants, a_coarse_mesh_is_known_as_one) {
  BodyMesh mesh;
  mesh.arrange(test::make_organ({.rings = 20, .around = 40}));
  EXPECT_TRUE(mesh.is_coarse());
}

TEST(TissueNoise, the_pattern_of_vertices_is_interpolated_between_texels_and_periodic) {
  const std::vector<std::uint8_t>& texels = tissue_noise().noise;
  constexpr int n = kTissueNoiseSize;
  const auto rest_of = [](const Vec3f& texel) {
    return Vec3f(((texel.array() + 0.5f) / static_cast<float>(n) - 0.37f) / 9.0f);
  };
  const auto texel_at = [&](int x, int y, int z, std::size_t k) {
    return static_cast<int>(texels[4 * static_cast<std::size_t>((z * n + y) * n + x) + k]);
  };
  for (const int i : {0, 5, 31, 62}) {
    const auto at = broad_pattern_at(rest_of(Vec3f(static_cast<float>(i), 7, 40)));
    const auto between = broad_pattern_at(rest_of(Vec3f(static_cast<float>(i) + 0.5f, 7, 40)));
    const auto periods_away = broad_pattern_at(rest_of(Vec3f(static_cast<float>(i - 2 * n), 7, 40.0f + n)));
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_NEAR(at[k], texel_at(i, 7, 40, k), 1);
      EXPECT_NEAR(between[k], (texel_at(i, 7, 40, k) + texel_at(i + 1, 7, 40, k)) / 2.0, 1);
      EXPECT_NEAR(periods_away[k], at[k], 1);
    }
  }
}

}  // namespace
}  // namespace sectio::draw_test

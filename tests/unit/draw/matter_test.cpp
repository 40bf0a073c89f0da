// The looks of bodies by their matter: surfaces, layers in walls, normals of walls.
#include <gtest/gtest.h>

#include <map>

#include "render_client/draw/body_mesh.h"
#include "tests/support/shapes.h"
#include "tests/unit/draw/drawn.h"
#include "tests/unit/draw/picture_difference.h"
#include "tests/unit/draw/test_organ.h"

namespace sectio::draw_test {
namespace {

using test::drawn;
using test::pixels_that_differ;

Frame from_above() {
  Frame frame = test::make_frame();
  frame.camera.eye_world_m = Vec3(0, -0.06, 0.16);
  frame.camera.target_world_m = Vec3(0, 0.003, 0.03);
  return frame;
}

template <class Is>
int count(const Image& image, const Is& is) {
  int n = 0;
  for (int y = 0; y < image.height_px; ++y)
    for (int x = 0; x < image.width_px; ++x) n += is(image.pixel(x, y));
  return n;
}

TEST(Matter, surfaces_differ_and_none_but_tissue_turns_grey_into_meat) {
  Frame frame = from_above();
  frame.bodies[0].skin_colour = frame.bodies[0].wall_colour = Vec3(0.52, 0.55, 0.58);
  std::vector<Image> pictures;
  for (const BodySurface surface :
       {BodySurface::tissue, BodySurface::plastic, BodySurface::steel, BodySurface::cloth}) {
    frame.bodies[0].surface = surface;
    pictures.push_back(drawn(frame));
    const int reddish = count(pictures.back(), [](const std::uint8_t* p) { return p[0] > p[2] + 25; });
    if (surface == BodySurface::tissue)
      EXPECT_GT(reddish, 300) << "walls of tissue are red whatever their colour";
    else
      EXPECT_EQ(reddish, 0) << static_cast<int>(surface);
  }
  for (std::size_t a = 0; a < pictures.size(); ++a)
    for (std::size_t b = a + 1; b < pictures.size(); ++b)
      EXPECT_GT(pixels_that_differ(pictures[a], pictures[b], 8), 5000) << a << " " << b;
}

TEST(Matter, walls_show_their_layers_by_depth) {
  Frame frame = from_above();
  frame.bodies[0].layers = {{0.003, Vec3(0.2, 0.2, 0.9)}, {0, Vec3(0.2, 0.9, 0.2)}};
  const auto is_blue = [](const std::uint8_t* p) { return p[2] > p[0] + 30 && p[2] > p[1] + 30; };
  const auto is_green = [](const std::uint8_t* p) { return p[1] > p[0] + 30 && p[1] > p[2] + 30; };
  const Image both = drawn(frame);
  EXPECT_GT(count(both, is_blue), 150);
  EXPECT_GT(count(both, is_green), 150);
  frame.bodies[0].layers.pop_back();
  const Image upper = drawn(frame);
  EXPECT_EQ(count(upper, is_green), 0);
  EXPECT_GT(count(upper, is_blue), count(both, is_blue) + 150) << "the last layer reaches all the way";
}

TEST(Matter, a_cut_that_lies_closed_is_seen_as_a_dark_line) {
  Frame frame = from_above();
  frame.bodies = {test::make_organ({.opening_m = 0})};
  const Image whole = drawn(frame);
  frame.bodies = {test::make_organ({.opening_m = 1e-7})};
  const Image cut = drawn(frame);
  int darker = 0, lighter = 0;
  for (int y = 0; y < cut.height_px; ++y)
    for (int x = 0; x < cut.width_px; ++x) {
      const int more = int{cut.pixel(x, y)[0]} - int{whole.pixel(x, y)[0]};
      darker += more < -30;
      lighter += more > 40;
    }
  EXPECT_GT(darker, 100);  // the cut is 110 pixels long
  EXPECT_LT(darker, 600);
  EXPECT_EQ(lighter, 0);
}

TEST(Matter, the_two_walls_of_a_cut_have_a_normal_each_where_they_meet) {
  const BodyFrame body = test::make_organ();
  BodyMesh mesh;
  mesh.arrange(body);
  ASSERT_TRUE(mesh.move(body));
  std::map<std::array<float, 3>, std::vector<Vec3f>> normals;  // normals of wall vertices, by place at rest
  std::map<std::array<float, 3>, float> depth_m;
  std::vector<std::uint8_t> is_seen(mesh.vertices().size(), 0);
  for (std::uint32_t i = mesh.walls().first; i < mesh.walls().first + mesh.walls().count; ++i) {
    const std::uint32_t v = mesh.indices()[i];
    if (is_seen[v]) continue;
    is_seen[v] = 1;
    const CanvasVertex& vertex = mesh.vertices()[v];
    const std::array at{vertex.rest_m.x(), vertex.rest_m.y(), vertex.rest_m.z()};
    normals[at].push_back(vertex.normal);
    const auto [known, is_new] = depth_m.try_emplace(at, vertex.depth_m);
    EXPECT_EQ(known->second, vertex.depth_m) << "copies of a vertex are equally deep";
  }
  int bottoms = 0;
  for (const auto& [at, n] : normals) {
    if (depth_m[at] < 0.004f) continue;
    ++bottoms;
    ASSERT_EQ(n.size(), 2u);
    EXPECT_LT(n[0].y() * n[1].y(), -0.05f) << "one faces left, the other right";
  }
  EXPECT_GE(bottoms, 8);
}

TEST(Matter, skin_has_a_normal_on_each_side_of_a_sharp_edge) {
  const TriangleSoup box = test::box(2, 2, 2, Vec3(0.02, 0.02, 0.02));
  BodyFrame body;
  for (const Vec3& x : box.vertices_body_m) body.rest_body_m.push_back(x.cast<float>());
  body.positions_world_m = body.rest_body_m;
  for (const auto& t : box.triangles) body.triangles.push_back({{t[0], t[1], t[2]}, Surface::skin});
  BodyMesh mesh;
  mesh.arrange(body);
  ASSERT_TRUE(mesh.move(body));
  EXPECT_EQ(mesh.vertices().size(), 6u * 9) << "each face of the box has its own";
  for (const CanvasVertex& v : mesh.vertices()) EXPECT_GT(v.normal.cwiseAbs().maxCoeff(), 0.999f);
}

}  // namespace
}  // namespace sectio::draw_test

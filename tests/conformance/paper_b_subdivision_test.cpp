// Paper B, sections 2 and 4: which triangles a cut leaves on the surface and in the groove.
#include <gtest/gtest.h>

#include "common/mesh/check.h"
#include "tests/support/pad_under_scalpel.h"

namespace sectio::test {
namespace {

constexpr double kPadDepth_m = 0.004;
const Vec3 kDown = -kPadDepth_m * Vec3::UnitZ();

// A cut along y = 14 mm through T1 ... T7: diagonals at x = 14, 24, 34 mm, cell borders at x = 20, 30, 40 mm.
const std::vector<std::array<double, 2>> kSevenFaces{{0.012, 0.014}, {0.018, 0.014}, {0.022, 0.014}, {0.028, 0.014},
                                                     {0.032, 0.014}, {0.038, 0.014}, {0.0425, 0.014}};

bool has(const std::vector<Corners3>& list, const Corners3& v) {
  return std::find(list.begin(), list.end(), turned(v)) != list.end();
}

// Whichever way round.
bool has_wall(const std::set<Corners3>& walls, VertexId a, VertexId b, VertexId c) {
  return walls.contains(turned({a, b, c})) || walls.contains(turned({a, c, b}));
}

// The vertex of a pair that a cut has opened which a triangle with both other corners uses.
VertexId of_pair_at(const std::vector<VertexId>& pair, const std::vector<Corners3>& faces, VertexId with) {
  for (const VertexId p : pair)
    for (const Corners3& f : faces)
      if (std::count(f.begin(), f.end(), p) && std::count(f.begin(), f.end(), with)) return p;
  return kNone;
}

TEST(B_STATE, B_STATE_4_first_and_last_are_end_triangles_the_others_midway) {
  PadUnderScalpel pad;
  pad.draw(kSevenFaces);
  const std::vector<std::pair<Face, std::size_t>> expected{
      {{1, 1, true}, 4},                                                                                 // T1
      {{1, 1, false}, 3},                                                                                // T2 ... T6
      {{2, 1, true}, 3},  {{2, 1, false}, 3}, {{3, 1, true}, 3}, {{3, 1, false}, 3}, {{4, 1, true}, 4},  // T7
  };
  const auto skin = pad.skin();
  std::size_t cut = 0;
  for (const auto& [face, triangles] : skin) cut += triangles.size() > 1;
  EXPECT_EQ(cut, expected.size());
  for (const auto& [face, count] : expected)
    EXPECT_EQ(skin.at(face).size(), count)
        << "column " << std::get<0>(face) << (std::get<2>(face) ? " above" : " below") << " the diagonal";
  EXPECT_EQ(pad.cuts.grooves.ends.size(), 2u) << "two ends, whatever the length";
}

TEST(B_STATE, B_STATE_5_a_curved_path_in_a_triangle_becomes_straight) {
  PadUnderScalpel pad;
  pad.enter_at(0.012, 0.014);
  // Over the diagonal at (14, 14) mm, round about in the face below it, out over x = 20 mm.
  for (const auto& [x, y] : {std::pair{0.016, 0.014}, {0.018, 0.012}, {0.0175, 0.0115}, {0.0185, 0.016}})
    pad.go(x, y), pad.expect_valid();
  pad.go(0.024, 0.016);
  pad.lift();
  pad.expect_valid();
  const auto triangles = pad.skin().at({1, 1, false});
  ASSERT_EQ(triangles.size(), 3u);
  // Straight: no vertex inside the face, and its two pairs are joined by edges.
  const auto in = pad.vertices_at(pad.top(0.014, 0.014)), out = pad.vertices_at(pad.top(0.020, 0.016));
  ASSERT_EQ(in.size(), 2u);
  ASSERT_EQ(out.size(), 2u);
  int joined = 0;
  for (const Corners3& t : triangles)
    for (const VertexId v : t) {
      const Vec3 x = pad.mesh.rest_body_m(v);
      const double from_rim = std::min({x.y() - 0.010, 0.020 - x.x(), x.x() - x.y()});
      EXPECT_LT(from_rim, 1e-6) << x.transpose();
    }
  for (const VertexId a : in)
    for (const VertexId b : out)
      joined += std::any_of(triangles.begin(), triangles.end(), [&](const Corners3& t) {
        return std::count(t.begin(), t.end(), a) && std::count(t.begin(), t.end(), b);
      });
  EXPECT_EQ(joined, 2) << "one straight side each";
}

// A cut from inside the face A B C (above the diagonal of cell 1, 1) over its diagonal B C.
class Opened : public testing::Test {
 protected:
  Opened() {
    pad.draw({{0.012, 0.016}, {0.013, 0.015}, {0.0145, 0.0135}, {0.017, 0.011}}, kPadDepth_m);
    a = pad.only_vertex_at(pad.top(0.010, 0.020));
    b = pad.only_vertex_at(pad.top(0.010, 0.010));
    c = pad.only_vertex_at(pad.top(0.020, 0.020));
    v1 = pad.only_vertex_at(p1);
    const auto pair = pad.vertices_at(p2);
    EXPECT_EQ(pair.size(), 2u);
    faces = pad.skin().at({1, 1, true});
    v2 = of_pair_at(pair, faces, b);
    v3 = of_pair_at(pair, faces, c);
  }
  PadUnderScalpel pad;
  const Vec3 p1 = PadUnderScalpel::top(0.012, 0.016), p2 = PadUnderScalpel::top(0.014, 0.014);
  std::vector<Corners3> faces;
  VertexId a, b, c, v1, v2, v3;
};

TEST_F(Opened, B_SUB_1_end_triangle_becomes_four_around_a_pair) {
  ASSERT_EQ(faces.size(), 4u);
  EXPECT_TRUE(has(faces, {a, b, v1}));
  EXPECT_TRUE(has(faces, {a, v1, c}));
  EXPECT_TRUE(has(faces, {b, v2, v1}));
  EXPECT_TRUE(has(faces, {c, v1, v3}));
  ASSERT_NE(v2, v3);
  EXPECT_EQ(pad.mesh.rest_body_m(v2), pad.mesh.rest_body_m(v3)) << "coincident at birth, bit for bit";
  EXPECT_EQ(pad.view().position(v2), pad.view().position(v3));
}

TEST_F(Opened, B_SUB_2_groove_of_an_end_triangle_is_four_triangles_down_to_the_tip) {
  const VertexId g1 = pad.only_vertex_at(p1 + kDown), g2 = pad.only_vertex_at(p2 + kDown);
  const auto walls = pad.walls();
  EXPECT_TRUE(has_wall(walls, v1, v2, g1));
  EXPECT_TRUE(has_wall(walls, v1, v3, g1));
  EXPECT_TRUE(has_wall(walls, g1, g2, v2));
  EXPECT_TRUE(has_wall(walls, g1, g2, v3));
  EXPECT_EQ(walls.size(), 8u) << "two end triangles of four";
}

class Midway : public testing::Test {
 protected:
  // In the face below the diagonal of cell 2, 1: in over A B (its diagonal) at (24, 14), out over A C at (30, 14).
  Midway() {
    pad.draw(kSevenFaces, kPadDepth_m);
    faces = pad.skin().at({2, 1, false});
    a = pad.only_vertex_at(pad.top(0.030, 0.020));
    b = pad.only_vertex_at(pad.top(0.020, 0.010));
    c = pad.only_vertex_at(pad.top(0.030, 0.010));
    const auto in = pad.vertices_at(p1), out = pad.vertices_at(p2);
    EXPECT_EQ(in.size(), 2u);
    EXPECT_EQ(out.size(), 2u);
    v1 = of_pair_at(in, faces, a);
    v2 = of_pair_at(in, faces, b);
    v3 = of_pair_at(out, faces, a);
    v4 = of_pair_at(out, faces, c);
  }
  PadUnderScalpel pad;
  const Vec3 p1 = PadUnderScalpel::top(0.024, 0.014), p2 = PadUnderScalpel::top(0.030, 0.014);
  std::vector<Corners3> faces;
  VertexId a, b, c, v1, v2, v3, v4;
};

// The paper prints the third one as BCV4, which would overlap V2V4C; the rest of the triangle is BCV2.
TEST_F(Midway, B_SUB_3_midway_triangle_becomes_three) {
  ASSERT_EQ(faces.size(), 3u);
  EXPECT_TRUE(has(faces, {a, v1, v3}));
  EXPECT_TRUE(has(faces, {v2, c, v4}));
  EXPECT_TRUE(has(faces, {b, c, v2}));
}

TEST(B_SUB, B_SUB_3_only_the_pair_is_new) {
  PadUnderScalpel pad;
  pad.enter_at(0.012, 0.014);
  for (const double x : {0.012, 0.018, 0.022, 0.028}) pad.go(x, 0.014);
  const std::uint32_t before = pad.mesh.vertex_count();
  pad.go(0.032, 0.014);  // one face further
  EXPECT_EQ(pad.mesh.vertex_count(), before + 3) << "a pair on the surface and a bottom";
  pad.expect_valid();
}

TEST_F(Midway, B_SUB_4_groove_of_a_midway_triangle_is_four_triangles) {
  const VertexId g1 = pad.only_vertex_at(p1 + kDown), g2 = pad.only_vertex_at(p2 + kDown);
  const auto walls = pad.walls();
  EXPECT_TRUE(has_wall(walls, v1, v3, g2));
  EXPECT_TRUE(has_wall(walls, v1, g1, g2));
  EXPECT_TRUE(has_wall(walls, v2, v4, g2));
  EXPECT_TRUE(has_wall(walls, v2, g1, g2));
  EXPECT_EQ(walls.size(), 7u * 4u);
}

TEST(B_SUB, B_SUB_5_groove_depth_follows_the_tip_and_holds_water) {
  PadUnderScalpel pad;
  const auto depth_at = [](double x) { return 0.002 + 0.2 * (x - 0.012); };  // 2 mm at T1, 8 mm at T7
  pad.enter_at(0.012, 0.014);
  for (int i = 0; i <= 305; ++i) {
    const double x = 0.012 + i * 1e-4;
    pad.go(x, 0.014, depth_at(x));
    ASSERT_NO_FATAL_FAILURE(pad.expect_valid());
  }
  pad.lift();
  ASSERT_NO_FATAL_FAILURE(pad.expect_valid());
  EXPECT_EQ(check(pad.mesh).euler_characteristic, 2);
  int bottoms = 0;
  for (VertexId v = 0; v < pad.mesh.vertex_slots(); ++v) {
    if (!pad.mesh.vertex_alive(v) || !pad.cuts.grooves.bottoms.contains(v)) continue;
    const Vec3 x = pad.mesh.rest_body_m(v);
    // A crossing gets the pose of the step that made it.
    EXPECT_NEAR(PadUnderScalpel::kTop_m - x.z(), depth_at(x.x()), 0.2 * 1e-4 + 1e-6);
    ++bottoms;
  }
  EXPECT_EQ(bottoms, 8) << "the first point, six crossings, the last point";
}

}  // namespace
}  // namespace sectio::test

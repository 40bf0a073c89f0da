// Whatever a knife does in the template style, the surface stays closed, oriented and manifold.
#include <gtest/gtest.h>

#include <random>

#include "tests/support/knife_on_mesh.h"

namespace sectio::test {
namespace {

struct Storm {
  std::uint32_t strokes = 0, steps = 0, refused = 0, left = 0;
  std::uint32_t most_components = 1;
};

// A knife at a random triangle, upright to within some twenty degrees, that follows a curve; sometimes it enters
// through the side, sometimes it goes right through.
void storm(const TriangleSoup& soup, std::uint64_t seed, int strokes, double step_m, Storm& result) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> gauss(0, 1);
  std::uniform_real_distribution<double> u(0, 1);
  TemplateSettings settings;
  settings.min_step_m = 0.02 * step_m;
  settings.open_top_m = 0.03 * step_m;
  settings.open_bottom_m = 0.015 * step_m;
  KnifeOnMesh knife(soup, settings);
  const std::uint32_t triangles_at_first = knife.mesh.triangle_count();
  for (int k = 0; k < strokes; ++k, ++result.strokes) {
    if (knife.mesh.triangle_count() > 10 * triangles_at_first) knife = KnifeOnMesh(soup, settings);
    std::uniform_int_distribution<TriangleId> any(0, knife.mesh.triangle_slots() - 1);
    TriangleId t = any(random);
    while (!knife.mesh.triangle(t).alive()) t = any(random);
    const auto& v = knife.mesh.triangle(t).v;
    const Vec3 a = knife.mesh.rest_body_m(v[0]), b = knife.mesh.rest_body_m(v[1]), c = knife.mesh.rest_body_m(v[2]);
    Vec3 w(u(random), u(random), u(random));
    if (u(random) < 0.2) w[0] = 0;           // on an edge
    if (u(random) < 0.1) w = Vec3::UnitX();  // at a vertex
    w /= w.sum();
    Vec3 up = (b - a).cross(c - a).stableNormalized();
    if (!(up.norm() > 0.5)) continue;
    up = (up + 0.3 * Vec3(gauss(random), gauss(random), gauss(random))).normalized();
    Vec3 ahead = Eigen::AngleAxisd(2 * M_PI * u(random), up) * up.unitOrthogonal();
    Vec3 x = w[0] * a + w[1] * b + w[2] * c;
    if (u(random) < 0.3) x -= 3 * step_m * ahead;
    const double depth_m = step_m * (u(random) < 0.2 ? 30 : 0.3 + 2 * u(random)), turn = 0.25 * gauss(random);
    TemplateStroke stroke;
    const int steps = std::uniform_int_distribution<int>(2, 25)(random);
    for (int i = 0; i < steps; ++i, ++result.steps) {
      const TemplateStrokeEnd end = knife.follow(stroke, {x - depth_m * up, up});
      ASSERT_TRUE(knife.valid()) << "seed " << seed << " stroke " << k << " step " << i;
      result.refused += end == TemplateStrokeEnd::refused;
      result.left += end == TemplateStrokeEnd::left_body;
      if (end != TemplateStrokeEnd::going) break;
      ahead = Eigen::AngleAxisd(turn, up) * ahead;
      ahead = (ahead - ahead.dot(up) * up).normalized();
      x += step_m * (0.1 + u(random)) * ahead;
    }
    knife.lift(stroke);
    ASSERT_TRUE(knife.valid()) << "seed " << seed << " stroke " << k << " lifted";
    if (k % 20 == 0) result.most_components = std::max(result.most_components, check(knife.mesh).components);
  }
}

void expect_storm(const TriangleSoup& soup, double step_m) {
  Storm sum;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    storm(soup, seed, 60, step_m, sum);
    if (testing::Test::HasFatalFailure()) return;
  }
  std::printf("%u strokes, %u steps, %u refused, %u left the body, up to %u components\n", sum.strokes, sum.steps,
              sum.refused, sum.left, sum.most_components);
  EXPECT_GT(sum.strokes, 150u);
  EXPECT_LT(sum.refused, sum.strokes / 3) << "refusals are for the exception";
}

TEST(RandomTemplateStrokes, ball) {
  expect_storm(ellipsoid(2, Vec3::Constant(0.05)), 0.012);
}
TEST(RandomTemplateStrokes, ball_with_small_steps) {
  expect_storm(ellipsoid(2, Vec3::Constant(0.05)), 0.003);
}
TEST(RandomTemplateStrokes, box_with_sharp_edges) {
  expect_storm(box(4, 3, 2, Vec3(0.08, 0.06, 0.04)), 0.012);
}
TEST(RandomTemplateStrokes, flat_lens) {
  expect_storm(ellipsoid(2, Vec3(0.05, 0.05, 0.004)), 0.01);
}
TEST(RandomTemplateStrokes, torus) {
  expect_storm(torus(16, 8, 0.05, 0.02), 0.01);
}
TEST(RandomTemplateStrokes, slivers) {
  expect_storm(ellipsoid(2, Vec3(0.2, 0.01, 0.01)), 0.004);
}
TEST(RandomTemplateStrokes, one_tetrahedron) {
  expect_storm({{{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}},
               0.01);
}

}  // namespace
}  // namespace sectio::test

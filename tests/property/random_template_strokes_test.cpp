// A knife may do anything in the template style: the surface stays closed, oriented and manifold.
#include <gtest/gtest.h>

#include <random>

#include "common/mesh/check.h"
#include "tests/support/knife_on_mesh.h"
#include "tests/support/random.h"
#include "tests/support/stroke_shapes.h"

namespace sectio::test {
namespace {

struct TemplateStorm {
  std::uint32_t strokes = 0, steps = 0, refused = 0, left = 0, joined = 0;
  std::uint32_t most_components = 1;
};

// A knife at a random triangle, upright to within some twenty degrees, that follows a curve; sometimes it enters
// through the side, sometimes it goes right through.
void stroke(KnifeOnMesh& knife, test::Random64& random, double step_m, TemplateStorm& result) {
  std::normal_distribution<double> gauss(0, 1);
  std::uniform_real_distribution<double> u(0, 1);
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
  if (!(up.norm() > 0.5)) return;
  up = (up + 0.3 * Vec3(gauss(random), gauss(random), gauss(random))).normalized();
  Vec3 ahead = Eigen::AngleAxisd(2 * M_PI * u(random), up) * up.unitOrthogonal();
  if (u(random) < 0.1) ahead = (b - a - (b - a).dot(up) * up).stableNormalized();  // along an edge
  Vec3 x = w[0] * a + w[1] * b + w[2] * c;
  if (u(random) < 0.3) x -= 3 * step_m * ahead;
  const double depth_m = step_m * (u(random) < 0.2 ? 30 : 0.3 + 2 * u(random)), turn = 0.25 * gauss(random);
  TemplateStroke stroke;
  const int steps = std::uniform_int_distribution<int>(2, 25)(random);
  for (int i = 0; i < steps; ++i, ++result.steps) {
    const TemplateStrokeEnd end = knife.follow(stroke, {x - depth_m * up, up});
    ASSERT_TRUE(knife.valid()) << "step " << i;
    result.refused += end == TemplateStrokeEnd::refused;
    result.left += end == TemplateStrokeEnd::left_body;
    result.joined += end == TemplateStrokeEnd::joined;
    if (end != TemplateStrokeEnd::going) break;
    ahead = Eigen::AngleAxisd(turn, up) * ahead;
    ahead = (ahead - ahead.dot(up) * up).normalized();
    x += step_m * (0.1 + u(random)) * ahead;
  }
  knife.lift(stroke);
  ++result.strokes;
}

void storm(const TriangleSoup& soup, std::uint64_t seed, int strokes, double step_m, TemplateStorm& result) {
  test::Random64 random(seed);
  TemplateSettings settings;
  settings.min_step_m = 0.02 * step_m;
  settings.open_top_m = 0.03 * step_m;
  settings.open_bottom_m = 0.015 * step_m;
  settings.patience_m = 2 * step_m;
  KnifeOnMesh knife(soup, settings);
  const std::uint32_t triangles_at_first = knife.mesh.triangle_count();
  for (int k = 0; k < strokes; ++k) {
    if (knife.mesh.triangle_count() > 10 * triangles_at_first) knife = KnifeOnMesh(soup, settings);
    stroke(knife, random, step_m, result);
    ASSERT_TRUE(knife.valid()) << "seed " << seed << " stroke " << k;
    if (k % 20 == 0) result.most_components = std::max(result.most_components, check(knife.mesh).components);
  }
}

class RandomTemplateStrokes : public testing::TestWithParam<StrokeShape> {};
INSTANTIATE_TEST_SUITE_P(On, RandomTemplateStrokes, testing::ValuesIn(stroke_shapes()), name_of);

TEST_P(RandomTemplateStrokes, leave_a_closed_manifold) {
  TemplateStorm sum;
  for (std::uint64_t seed = 1; seed <= kStrokeSeeds; ++seed) {
    storm(GetParam().soup, seed, kStrokesPerSeed, GetParam().step_m, sum);
    if (testing::Test::HasFatalFailure()) return;
  }
  std::printf("%u strokes, %u steps, %u refused, %u left the body, %u joined, up to %u components\n", sum.strokes,
              sum.steps, sum.refused, sum.left, sum.joined, sum.most_components);
  EXPECT_GT(sum.strokes, 600u / kSampled);
  EXPECT_LT(sum.refused, sum.strokes / 3) << "refusals are for the exception";
}

// The volume of the grooves and the volume that is left add up to the whole, part by part.
TEST_P(RandomTemplateStrokes, volume_is_accounted_for) {
  TemplateSettings settings;
  const double step_m = GetParam().step_m;
  settings.min_step_m = 0.02 * step_m;
  settings.open_top_m = 0.03 * step_m;
  settings.open_bottom_m = 0.015 * step_m;
  KnifeOnMesh knife(GetParam().soup, settings);
  VolumeAccount account(knife.mesh);
  knife.applied = [&](const TopologyDelta& delta) { account.add(delta, knife.mesh); };
  const double whole_m3 = check(knife.mesh).volume_m3;
  test::Random64 random(11);
  TemplateStorm ignored;
  for (int k = 0; k < 12; ++k) {
    stroke(knife, random, step_m, ignored);
    ASSERT_TRUE(knife.valid());
  }
  EXPECT_NEAR(check(knife.mesh).volume_m3 + account.removed_m3(), whole_m3, 1e-9 * whole_m3);
  EXPECT_NE(account.removed_m3(), 0);
}

// To and fro in one body, over and over: what has been cut is not cut again and again.
TEST(RandomTemplateStrokes, a_cut_that_goes_on_for_long_does_not_grow_without_bound) {
  PadUnderKnife pad;
  TemplateStroke stroke;
  for (double x = 0.0115; x < 0.03; x += 4e-4) pad.follow(stroke, pad.at(x, 0.0143, 0.006));
  const std::uint32_t once = pad.mesh.triangle_count();
  for (int i = 0; i < 2000 / kSampled; ++i)
    pad.follow(stroke, pad.at(0.0303 + 4e-4 * std::sin(0.7 * i), 0.0143 + 2e-5 * std::cos(0.3 * i), 0.006));
  ASSERT_TRUE(pad.valid());
  EXPECT_LT(pad.mesh.triangle_count(), once + 60);
}

}  // namespace
}  // namespace sectio::test

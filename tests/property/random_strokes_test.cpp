// An instrument may do anything: the surface stays closed, oriented and manifold.
#include <gtest/gtest.h>

#include <random>

#include "common/mesh/check.h"
#include "tests/support/random.h"
#include "tests/support/scalpel_on_mesh.h"
#include "tests/support/stroke_shapes.h"

namespace sectio::test {
namespace {

Vec3 rest_normal(const TriangleMesh& mesh, TriangleId t) {
  const auto& v = mesh.triangle(t).v;
  return (mesh.rest_body_m(v[1]) - mesh.rest_body_m(v[0]))
      .cross(mesh.rest_body_m(v[2]) - mesh.rest_body_m(v[0]))
      .stableNormalized();
}

TriangleId random_triangle(const TriangleMesh& mesh, test::Random64& random) {
  std::uniform_int_distribution<TriangleId> any(0, mesh.triangle_slots() - 1);
  TriangleId t = any(random);
  while (!mesh.triangle(t).alive()) t = any(random);
  return t;
}

// Barycentric coordinates that are often degenerate: corners, edges, near edges.
Vec3 random_bary(test::Random64& random) {
  std::uniform_real_distribution<double> u(0, 1);
  Vec3 b(u(random), u(random), u(random));
  switch (std::uniform_int_distribution<int>(0, 5)(random)) {
    case 0:
      b = Vec3::UnitY();
      break;
    case 1:
      b[0] = 0;
      break;
    case 2:
      b[2] *= 1e-6;
      break;
    default:
      break;
  }
  return b / b.sum();
}

struct Storm {
  std::uint32_t strokes = 0, cuts = 0, refused = 0, islands = 0, joins = 0, mends = 0;
};

Storm storm(const TriangleSoup& soup, std::uint64_t seed, int strokes, double step_m, bool is_tidied = false) {
  test::Random64 random(seed);
  std::normal_distribution<double> gauss(0, 1);
  std::uniform_real_distribution<double> u(0, 1);
  StrokeSettings settings;
  settings.join_tolerance_m = step_m;
  settings.min_step_m = 0.02 * step_m;
  settings.min_depth_m = 0.05 * step_m;
  settings.release_depth_m = -1;
  Storm result;
  ScalpelOnMesh scalpel(soup, settings);
  const std::uint32_t triangles_at_first = scalpel.mesh.triangle_count();
  for (int k = 0; k < strokes; ++k) {
    if (scalpel.mesh.triangle_count() > 12 * triangles_at_first) scalpel = ScalpelOnMesh(soup, settings);
    const TriangleId t = random_triangle(scalpel.mesh, random);
    Vec3 bary = random_bary(random);
    const auto& v = scalpel.mesh.triangle(t).v;
    Vec3 x = bary[0] * scalpel.mesh.rest_body_m(v[0]) + bary[1] * scalpel.mesh.rest_body_m(v[1]) +
             bary[2] * scalpel.mesh.rest_body_m(v[2]);
    Vec3 up = rest_normal(scalpel.mesh, t);
    if (!(up.norm() > 0.5)) continue;
    up = (up + 0.3 * Vec3(gauss(random), gauss(random), gauss(random))).normalized();
    Vec3 ahead = up.unitOrthogonal();
    ahead = Eigen::AngleAxisd(2 * M_PI * u(random), up) * ahead;
    const double turn = 0.4 * gauss(random);
    const int steps = std::uniform_int_distribution<int>(1, 40)(random);
    scalpel.enter(t, bary);
    for (int i = 0; i < steps; ++i) {
      if (i > 0 && !scalpel.going()) break;
      if (i > 0) {
        const Stroke& s = *scalpel.stroke();
        const MeshDraft at(scalpel.mesh, scalpel.view());
        const Vec3 n = rest_normal_of(at, s);
        if (n.dot(up) > 0.2) up = (0.8 * up + 0.2 * n).normalized();  // the hand follows the surface
      }
      ahead = Eigen::AngleAxisd(turn, up) * ahead;
      ahead = (ahead - ahead.dot(up) * up).normalized();
      x += step_m * (0.2 + u(random)) * ahead;
      const CutPlan plan = scalpel.to(x, up, step_m * (0.2 + 2 * u(random)));
      result.islands += static_cast<std::uint32_t>(plan.islands.size());
      for (const StrokeOutcome& o : plan.outcomes) result.joins += o.end == StrokeEnd::joined;
      const SurfaceReport report = check(scalpel.mesh);
      EXPECT_TRUE(report.valid()) << "stroke " << k << " step " << i << ": " << report.first_defect;
      if (!report.valid()) return result;
    }
    if (scalpel.going()) scalpel.lift();
    EXPECT_FALSE(scalpel.going());
    const SurfaceReport report = check(scalpel.mesh);
    EXPECT_TRUE(report.valid()) << "stroke " << k << " lifted: " << report.first_defect;
    if (!report.valid()) return result;
    ++result.strokes;
    if (!is_tidied) continue;
    const bool was_whole = scalpel.flaw().empty();  // islands and cuts that cross themselves aside
    result.mends += static_cast<std::uint32_t>(scalpel.tidy());
    const std::string flaw = was_whole ? scalpel.flaw() : check(scalpel.mesh).first_defect;
    EXPECT_TRUE(flaw.empty()) << "stroke " << k << " tidied: " << flaw;
    EXPECT_EQ(scalpel.rejected_deltas, 0u) << "stroke " << k << " tidied";
    if (testing::Test::HasFailure()) return result;
  }
  result.cuts = scalpel.made;
  result.refused = scalpel.refused + scalpel.rejected_deltas;
  return result;
}

class RandomStrokes : public testing::TestWithParam<StrokeShape> {};
INSTANTIATE_TEST_SUITE_P(On, RandomStrokes, testing::ValuesIn(stroke_shapes()), name_of);

TEST_P(RandomStrokes, leave_a_closed_manifold) {
  Storm sum;
  for (std::uint64_t seed = 1; seed <= kStrokeSeeds; ++seed) {
    const Storm s = storm(GetParam().soup, seed, kStrokesPerSeed, GetParam().step_m);
    if (testing::Test::HasFailure()) return;
    sum.strokes += s.strokes;
    sum.refused += s.refused;
    sum.joins += s.joins;
    sum.islands += s.islands;
  }
  std::printf("%u strokes, %u refused, %u joins, %u islands\n", sum.strokes, sum.refused, sum.joins, sum.islands);
  EXPECT_GT(sum.strokes, 600u / kSampled);
  EXPECT_LT(sum.refused, sum.strokes / 5 + 1) << "refusals are for the exception";
}

// Later strokes cross, join and go on from lips that have been mended.
TEST_P(RandomStrokes, leave_a_closed_manifold_when_slivers_are_mended_after_each) {
  const Storm sum = storm(GetParam().soup, 101, kStrokesPerSeed, GetParam().step_m, true);
  std::printf("%u strokes, %u refused, mended %u times\n", sum.strokes, sum.refused, sum.mends);
  EXPECT_GT(sum.mends, 0u) << "no stroke left a sliver: nothing was tried";
  EXPECT_LT(sum.refused, sum.strokes / 5 + 1) << "refusals are for the exception";
}

}  // namespace
}  // namespace sectio::test

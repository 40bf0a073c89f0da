// Paper B, 5.2: a cut that runs into an end triangle joins the cut that left it; a loop frees an island. And cuts along
// and across what is there already.
#include <gtest/gtest.h>

#include "common/mesh/check.h"
#include "tests/support/pad_under_scalpel.h"

namespace sectio::test {
namespace {

using Path = std::vector<std::array<double, 2>>;

StrokeSettings settings_with_tolerance(double join_tolerance_m) {
  StrokeSettings s;
  s.join_tolerance_m = join_tolerance_m;
  return s;
}

// Points every `step_m` along a polyline.
Path dense(const Path& corners, double step_m) {
  Path path;
  for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
    const Eigen::Vector2d a(corners[i][0], corners[i][1]), b(corners[i + 1][0], corners[i + 1][1]);
    const int n = static_cast<int>(std::ceil((b - a).norm() / step_m));
    for (int k = 0; k < n; ++k) {
      const Eigen::Vector2d x = a + (b - a) * k / n;
      path.push_back({x.x(), x.y()});
    }
  }
  path.push_back(corners.back());
  return path;
}

struct Result {
  int joins = 0, islands = 0;
};
Result cut(PadUnderScalpel& pad, const Path& path, double depth_m = 0.004, bool lift = true) {
  Result r;
  pad.enter_at(path[0][0], path[0][1]);
  for (const auto& [x, y] : path) {
    const CutPlan plan = pad.go(x, y, depth_m);
    pad.expect_valid();
    r.islands += static_cast<int>(plan.islands.size());
    for (const StrokeOutcome& o : plan.outcomes) r.joins += o.end == StrokeEnd::joined;
    if (!pad.going()) break;
  }
  if (lift && pad.going()) pad.lift();
  pad.expect_valid();
  return r;
}

double volume_m3(const TriangleMesh& mesh, std::uint32_t component) {
  const auto label = component_of_triangle(mesh);
  double sum = 0;
  for (TriangleId t = 0; t < mesh.triangle_slots(); ++t) {
    if (label[t] != component) continue;
    const auto& v = mesh.triangle(t).v;
    sum += mesh.rest_body_m(v[0]).dot(mesh.rest_body_m(v[1]).cross(mesh.rest_body_m(v[2]))) / 6;
  }
  return sum;
}

// The first cut begins at (12, 16) in the face A B C above the diagonal of cell 1, 1 and leaves over the diagonal.
constexpr std::array<double, 2> kFirst{0.012, 0.016};

TEST(B_JOIN, B_JOIN_1_entering_an_end_triangle_splits_it_and_the_end_and_sews_the_grooves) {
  PadUnderScalpel pad(settings_with_tolerance(1.5e-3));
  cut(pad, dense({kFirst, {0.017, 0.011}}, 5e-4));
  const VertexId a = pad.only_vertex_at(pad.top(0.010, 0.020)), b = pad.only_vertex_at(pad.top(0.010, 0.010));
  const VertexId v1 = pad.only_vertex_at(pad.top(kFirst[0], kFirst[1]));
  ASSERT_TRUE(pad.cuts.grooves.ends.contains(v1));
  const VertexId g1 = pad.cuts.grooves.ends.at(v1);
  const auto before = pad.skin().at({1, 1, true});
  ASSERT_TRUE(std::count(before.begin(), before.end(), turned({a, b, v1}))) << "the end triangle A B V1";

  // From the left over A B (x = 10 mm) towards V1.
  const Result r = cut(pad, dense({{0.004, 0.0165}, kFirst}, 5e-4));
  EXPECT_EQ(r.joins, 1);
  const auto after = pad.skin().at({1, 1, true});
  EXPECT_EQ(after.size(), before.size() + 1) << "A B V1 became two triangles";
  EXPECT_EQ(std::count(after.begin(), after.end(), turned({a, b, v1})), 0);
  const auto halves = pad.vertices_at(pad.top(kFirst[0], kFirst[1]));
  ASSERT_EQ(halves.size(), 2u) << "V1 and V1'";
  // Each of the two triangles has its own half, and one of the two on A B.
  std::set<VertexId> of_a, of_b;
  for (const Corners3& t : after)
    for (const VertexId h : halves) {
      if (!std::count(t.begin(), t.end(), h)) continue;
      if (std::count(t.begin(), t.end(), a)) of_a.insert(h);
      if (std::count(t.begin(), t.end(), b)) of_b.insert(h);
    }
  EXPECT_EQ(of_a.size(), 1u);
  EXPECT_EQ(of_b.size(), 1u);
  EXPECT_NE(of_a, of_b);
  // Both halves stand on the groove of the first cut, which goes on into the second.
  std::map<VertexId, int> on_g1;
  for (const Corners3& w : pad.walls())
    for (const VertexId h : halves)
      if (std::count(w.begin(), w.end(), h) && std::count(w.begin(), w.end(), g1)) ++on_g1[h];
  EXPECT_EQ(on_g1[halves[0]], 2) << "one triangle of each cut's groove";
  EXPECT_EQ(on_g1[halves[1]], 2);
  EXPECT_EQ(pad.cuts.grooves.ends.size(), 2u) << "one cut now, with two ends";
  EXPECT_EQ(check(pad.mesh).euler_characteristic, 2);
}

TEST(B_JOIN, B_JOIN_1_all_four_end_triangles_of_a_cut_can_be_entered) {
  // The first cut from (12, 16) over the diagonal to (17, 11): end triangles on both sides of both ends.
  const std::array<double, 2> last{0.017, 0.011};
  const std::vector<std::pair<Path, std::array<double, 2>>> ways{{{{0.006, 0.0155}, kFirst}, kFirst},
                                                                 {{{0.0125, 0.024}, kFirst}, kFirst},
                                                                 {{{0.024, 0.0115}, last}, last},
                                                                 {{{0.0165, 0.004}, last}, last}};
  for (const auto& [way, end] : ways) {
    PadUnderScalpel pad(settings_with_tolerance(1e-3));
    cut(pad, dense({kFirst, last}, 5e-4));
    EXPECT_EQ(cut(pad, dense(way, 5e-4)).joins, 1) << "from " << way[0][0] << ", " << way[0][1];
    EXPECT_EQ(pad.vertices_at(pad.top(end[0], end[1])).size(), 2u);
    EXPECT_EQ(pad.cuts.grooves.ends.size(), 2u);
  }
}

const Path kLoop{{0.022, 0.014}, {0.041, 0.0135}, {0.043, 0.027}, {0.024, 0.0285}, {0.0215, 0.0145}, {0.022, 0.014}};

TEST(B_JOIN, B_JOIN_2_a_loop_frees_an_island) {
  PadUnderScalpel pad;
  const double whole_m3 = check(pad.mesh).volume_m3;
  const Result r = cut(pad, dense(kLoop, 4e-4));
  EXPECT_EQ(r.joins, 1);
  EXPECT_EQ(r.islands, 1);
  const SurfaceReport report = check(pad.mesh);
  EXPECT_EQ(report.components, 2u);
  EXPECT_EQ(report.euler_characteristic, 4) << "two spheres";
  EXPECT_TRUE(pad.cuts.grooves.ends.empty());
  const double a = volume_m3(pad.mesh, 0), b = volume_m3(pad.mesh, 1);
  EXPECT_GT(std::min(a, b), 0.5 * 0.0195 * 0.0135 * 0.004) << "the island has the depth of the groove";
  EXPECT_NEAR((a + b) / whole_m3, 1, 1e-12) << "nothing is lost";
}

// The skin that a line through the body leaves along `outward`.
Entry entry_outward(const TriangleMesh& mesh, const Vec3& outward) {
  for (TriangleId t = 0; t < mesh.triangle_slots(); ++t) {
    const auto& v = mesh.triangle(t).v;
    Eigen::Matrix3d corners;
    for (int k = 0; k < 3; ++k) corners.col(k) = mesh.rest_body_m(v[static_cast<std::size_t>(k)]);
    const Vec3 weights = corners.inverse() * outward;
    if (weights.minCoeff() >= 0) return {0, t, weights / weights.sum()};
  }
  return {};
}

// Around a limb: half of it came free, however shallow the ring was.
TEST(B_JOIN, B_JOIN_2_a_ring_around_a_limb_frees_half_of_it_only_when_it_goes_through_its_neck) {
  constexpr double kRadius_m = 0.012;
  for (const double depth_m : {0.0015, 0.004, 0.0105}) {
    ScalpelOnMesh limb(ellipsoid(4, Vec3(kRadius_m, kRadius_m, 0.06)));
    const auto outward = [](int i) {
      return Vec3(std::cos(0.03 * i + 0.2), std::sin(0.03 * i + 0.2), 1e-4).normalized();
    };
    std::size_t freed = 0, kept = 0;
    limb.entries.push_back(entry_outward(limb.mesh, outward(0)));
    for (int i = 0; i < 240; ++i) {
      const CutPlan plan = limb.to(kRadius_m * outward(i), outward(i), depth_m);
      freed += plan.islands.size();
      kept += plan.kept_islands.size();
      ASSERT_TRUE(i % 20 != 0 || limb.flaw().empty()) << i << ": " << limb.flaw();
      if (!limb.going()) break;
    }
    EXPECT_EQ(freed, depth_m > 0.01 ? 1u : 0u) << depth_m;
    EXPECT_EQ(kept, depth_m > 0.01 ? 0u : 1u) << depth_m;
  }
}

// Between two rings that are each too shallow lies a band that is thin along the limb, and as thick as the limb.
TEST(B_JOIN, B_JOIN_2_two_rings_around_a_limb_free_no_slice_of_it) {
  constexpr double kRadius_m = 0.012;
  for (const double apart_m : {0.003, 0.006, 0.012}) {
    ScalpelOnMesh limb(ellipsoid(4, Vec3(kRadius_m, kRadius_m, 0.06)));
    std::size_t freed = 0, kept = 0;
    for (const double z_m : {1e-6, apart_m}) {
      const auto place_m = [&](int i) {
        return Vec3(kRadius_m * std::cos(0.03 * i + 0.2), kRadius_m * std::sin(0.03 * i + 0.2), z_m);
      };
      const auto outward = [&](int i) { return Vec3(place_m(i).x(), place_m(i).y(), 0).normalized(); };
      limb.entries.push_back(entry_outward(limb.mesh, place_m(0)));
      for (int i = 0; i < 240; ++i) {
        const CutPlan plan = limb.to(place_m(i), outward(i), 0.0015);
        freed += plan.islands.size();
        kept += plan.kept_islands.size();
        if (!limb.going()) break;
      }
      if (limb.going()) limb.lift();
    }
    EXPECT_EQ(freed, 0u) << apart_m;
    EXPECT_EQ(kept, 2u) << apart_m;
    EXPECT_EQ(limb.flaw(), "");
  }
}

// Nine of ten triangles lie inside: the search ends with the ground, which is high.
TEST(B_JOIN, B_JOIN_2_a_loop_frees_an_island_however_fine_its_mesh_is) {
  TriangleSoup lens = ellipsoid(5, Vec3::Ones());
  for (Vec3& x : lens.vertices_body_m) {
    const double from_pole = std::acos(std::clamp(x.z(), -1.0, 1.0)) / M_PI, angle = M_PI * std::pow(from_pole, 4);
    const Vec3 level = Vec3(x.x(), x.y(), 0).stableNormalized();
    x = Vec3(0.024 * std::sin(angle) * level.x(), 0.024 * std::sin(angle) * level.y(), 0.01 * std::cos(angle));
  }
  ScalpelOnMesh body(lens);
  constexpr double kAround_m = 0.012;
  const auto place_m = [&](int i) {
    return Vec3(kAround_m * std::cos(0.05 * i), kAround_m * std::sin(0.05 * i), 0.01 * std::sqrt(0.75));
  };
  std::size_t freed = 0, kept = 0;
  body.entries.push_back(entry_outward(body.mesh, place_m(0)));
  for (int i = 0; i < 150 && (i == 0 || body.going()); ++i) {
    const CutPlan plan = body.to(place_m(i), Vec3::UnitZ(), 0.002);
    freed += plan.islands.size();
    kept += plan.kept_islands.size();
  }
  EXPECT_EQ(freed, 1u);
  EXPECT_EQ(kept, 0u);
  EXPECT_EQ(body.flaw(), "");
}

TEST(B_JOIN, B_JOIN_2_where_the_scene_forbids_islands_the_loop_stays_in_one_piece) {
  PadUnderScalpel pad;
  pad.loops_free_islands = false;
  pad.enter_at(kLoop[0][0], kLoop[0][1]);
  bool joined = false;
  for (const auto& [x, y] : dense(kLoop, 4e-4)) {
    const CutPlan plan = pad.go(x, y);
    if (plan.outcomes.empty()) continue;
    joined = plan.outcomes[0].end == StrokeEnd::joined;
    break;
  }
  EXPECT_TRUE(joined);
  pad.expect_valid();
  EXPECT_EQ(check(pad.mesh).components, 1u);
  EXPECT_EQ(check(pad.mesh).euler_characteristic, 2);
}

TEST(B_JOIN, B_JOIN_2_island_within_an_island) {
  PadUnderScalpel pad;
  EXPECT_EQ(cut(pad, dense(kLoop, 4e-4), 0.006).islands, 1);
  const Path inner{{0.029, 0.018}, {0.037, 0.018}, {0.037, 0.0245}, {0.029, 0.0245}, {0.0285, 0.0185}, {0.029, 0.018}};
  StrokeSettings finer = pad.settings;
  finer.join_tolerance_m = 1e-3;
  pad.settings = finer;
  EXPECT_EQ(cut(pad, dense(inner, 4e-4), 0.003).islands, 1);
  EXPECT_EQ(check(pad.mesh).components, 3u);
  EXPECT_EQ(check(pad.mesh).euler_characteristic, 6);
  EXPECT_NEAR(check(pad.mesh).volume_m3 / (0.06 * 0.04 * 0.02), 1, 1e-12);
}

TEST(B_JOIN, B_JOIN_3_two_cuts_become_one) {
  PadUnderScalpel pad(settings_with_tolerance(1e-3));
  cut(pad, dense({{0.012, 0.016}, {0.027, 0.017}}, 5e-4));
  cut(pad, dense({{0.052, 0.013}, {0.037, 0.016}}, 5e-4));
  EXPECT_EQ(pad.cuts.grooves.ends.size(), 4u);
  // From the end of the one to the end of the other.
  EXPECT_EQ(cut(pad, dense({{0.0268, 0.017}, {0.037, 0.016}}, 5e-4)).joins, 1);
  EXPECT_EQ(pad.cuts.grooves.ends.size(), 2u);
  EXPECT_EQ(check(pad.mesh).euler_characteristic, 2);
}

TEST(B_JOIN, B_JOIN_4_close_enough_joins_further_off_does_not) {
  for (const double gap_m : {0.8e-3, 2.5e-3}) {
    PadUnderScalpel pad(settings_with_tolerance(1.5e-3));
    cut(pad, dense({kFirst, {0.017, 0.011}}, 5e-4));
    const Result r = cut(pad, dense({{0.0045, 0.016}, {kFirst[0] - gap_m, kFirst[1]}}, 2.5e-4));
    EXPECT_EQ(r.joins, gap_m < 1.5e-3 ? 1 : 0) << "gap " << gap_m;
    EXPECT_EQ(pad.cuts.grooves.ends.size(), gap_m < 1.5e-3 ? 2u : 4u);
  }
}

TEST(B_FUT, B_FUT_2_short_cuts_continue_each_other) {
  PadUnderScalpel pad(settings_with_tolerance(1e-3)), at_once(settings_with_tolerance(1e-3));
  cut(at_once, dense({{0.011, 0.014}, {0.046, 0.0155}}, 5e-4));
  double x = 0.011, y = 0.014;
  for (int i = 0; i < 5; ++i) {  // each begins near the end of the one before
    cut(pad, dense({{x, y}, {x + 0.007, y + 0.0003}}, 5e-4));
    x += 0.007, y += 0.0003;
    EXPECT_EQ(pad.cuts.grooves.ends.size(), 2u) << "still one cut after piece " << i;
    if (i < 4) x -= 3e-4;
  }
  EXPECT_EQ(check(pad.mesh).euler_characteristic, 2);
  EXPECT_GE(pad.walls().size(), at_once.walls().size());
}

TEST(B_SUB, exactly_through_a_vertex) {
  PadUnderScalpel pad;
  cut(pad,
      dense({{0.016, 0.020}, {0.044, 0.020}}, 5e-4));  // along the row's border: through (20, 20), (30, 20), (40, 20)
  for (const double x : {0.020, 0.030, 0.040})
    EXPECT_EQ(pad.vertices_at(pad.top(x, 0.020)).size(), 2u) << "the vertex at x = " << x << " is opened";
  EXPECT_EQ(check(pad.mesh).euler_characteristic, 2);
}

TEST(B_SUB, along_a_diagonal_edge) {
  PadUnderScalpel pad;
  cut(pad, dense({{0.012, 0.012}, {0.038, 0.038}}, 5e-4));
  EXPECT_EQ(pad.vertices_at(pad.top(0.020, 0.020)).size(), 2u);
  EXPECT_EQ(pad.vertices_at(pad.top(0.030, 0.030)).size(), 2u);
  EXPECT_EQ(pad.refused + pad.rejected_deltas, 0u);
}

TEST(B_SUB, starting_on_a_vertex_and_on_an_edge) {
  for (const std::array<double, 2> start : {std::array{0.020, 0.020}, {0.020, 0.014}, {0.014, 0.014}}) {
    PadUnderScalpel pad;
    cut(pad, dense({start, {0.0365, 0.0172}}, 5e-4));
    EXPECT_EQ(pad.only_vertex_at(pad.top(start[0], start[1])) != kNone, true);
    EXPECT_EQ(pad.cuts.grooves.ends.size(), 2u);
    EXPECT_EQ(pad.refused + pad.rejected_deltas, 0u);
  }
}

TEST(B_SUB, round_the_edge_of_the_body) {
  PadUnderScalpel pad;
  pad.enter_at(0.045, 0.016);
  for (double x = 0.045; x < 0.066; x += 5e-4) {
    pad.go(x, 0.016);
    ASSERT_NO_FATAL_FAILURE(pad.expect_valid());
  }
  if (pad.going()) pad.lift();
  pad.expect_valid();
}

// The place where two cuts have met: the one at rest that most vertices share.
Vec3 meeting_place(const PadUnderScalpel& pad) {
  Vec3 place = Vec3::Zero();
  std::size_t most = 0;
  for (const Rung& rung : pad.cuts.grooves.rungs)
    if (const auto n = pad.vertices_at(pad.mesh.rest_body_m(rung.lip)).size(); n > most)
      most = n, place = pad.mesh.rest_body_m(rung.lip);
  return place;
}

// Upright through the middle of another groove, and slantwise down one of its walls.
TEST(B_JOIN, across_an_older_cut) {
  for (const double step_m : {1e-4, 5e-4, 3e-3, 2e-2}) {
    PadUnderScalpel pad(settings_with_tolerance(5e-4));
    cut(pad, dense({{0.012, 0.0155}, {0.048, 0.0165}}, 5e-4));
    const Result r = cut(pad, dense({{0.0275, 0.006}, {0.0285, 0.034}}, step_m), 0.003);
    EXPECT_EQ(pad.refused + pad.rejected_deltas, 0u) << "step " << step_m;
    EXPECT_EQ(r.joins, 1) << "they meet";
    EXPECT_EQ(pad.vertices_at(meeting_place(pad)).size(), 4u) << "and the second one goes on: four corners";
    EXPECT_EQ(pad.cuts.grooves.ends.size(), 4u);
    EXPECT_EQ(check(pad.mesh).components, 1u);
    EXPECT_NEAR(check(pad.mesh).volume_m3 / (0.06 * 0.04 * 0.02), 1, 1e-12);
  }
}

TEST(B_JOIN, down_the_wall_of_an_open_groove) {
  PadUnderScalpel pad(settings_with_tolerance(5e-4));
  cut(pad, dense({{0.012, 0.0155}, {0.048, 0.0165}}, 5e-4), 0.006);
  // Open the groove in the present positions, as springs would.
  std::map<std::tuple<double, double, double>, std::vector<VertexId>> at;
  for (VertexId v = 0; v < pad.mesh.vertex_slots(); ++v)
    if (pad.mesh.vertex_alive(v)) {
      const Vec3 x = pad.mesh.rest_body_m(v);
      at[{x.x(), x.y(), x.z()}].push_back(v);
    }
  int opened = 0;
  for (const auto& [x, pair] : at) {
    if (pair.size() != 2) continue;
    for (const VertexId v : pair) {
      // The half whose skin lies to the left goes left.
      double side = 0;
      for (const Triangle& t : pad.mesh.triangles())
        if (pad.on_top(t) && t.corner_of(v) >= 0)
          for (const VertexId w : t.v) side += pad.mesh.rest_body_m(w).y() - pad.mesh.rest_body_m(v).y();
      pad.particles.position_world_m[v].y() += static_cast<float>(side > 0 ? 0.0015 : -0.0015);
    }
    ++opened;
  }
  ASSERT_GE(opened, 5);
  for (const double depth_m : {0.002, 0.008}) {
    PadUnderScalpel p = pad;
    cut(p, dense({{0.0275, 0.006}, {0.0285, 0.034}}, 4e-4), depth_m);
    EXPECT_EQ(p.refused + p.rejected_deltas, 0u);
    EXPECT_TRUE(check(p.mesh).valid());
  }
}

}  // namespace
}  // namespace sectio::test

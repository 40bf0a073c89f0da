#include "sim_server/collision/front_tracker.h"

#include <gtest/gtest.h>

#include "tests/unit/collision/surfaces.h"

namespace sectio::collision_test {
namespace {

// An upright scalpel with its tip at `tip`, its sharp edge leaning forward along x.
ToolCorners scalpel(const Vec3& tip) {
  return {{tip, tip + Vec3(0, 0, 0.03), tip + Vec3(0.006, 0, 0.012), tip + Vec3(0.006, 0, 0.03)}};
}

// Runs a tool through poses and compares each step with the test of every triangle.
class Stroke {
 public:
  explicit Stroke(const SurfaceBody& body) : body_(body), tree_(body.view()) {}

  ToolContact move(const ToolCorners& to, bool continuous = true) {
    if (!started_) last_ = to;
    started_ = true;
    const FrontStep step{last_, to, continuous};
    const ToolContact contact = tracker_.follow(body_.view(), tree_, step);
    const ToolContact expected = every_contact(body_.view(), step);
    missed += !same(contact, expected);
    touched += expected.touches();
    edges += expected.segments[1].swept.size();
    last_ = to;
    return contact;
  }

  const FrontCounters& counters() const { return tracker_.counters(); }
  SurfaceTree& tree() { return tree_; }
  FrontTracker& tracker() { return tracker_; }

  int missed = 0, touched = 0;
  std::size_t edges = 0;

 private:
  const SurfaceBody& body_;
  SurfaceTree tree_;
  FrontTracker tracker_;
  ToolCorners last_;
  bool started_ = false;
};

SurfaceBody pad() {
  std::vector<Corners> triangles;
  add_box(triangles, Vec3(-0.06, -0.03, -0.02), Vec3(0.06, 0.03, 0), {40, 20, 4});
  return SurfaceBody(weld(triangles));
}

TEST(B_CD, B_CD_1_the_instrument_is_four_segments) {
  const SurfaceBody body = pad();
  Stroke stroke(body);
  stroke.move(scalpel({0.0003, 0.0004, 0.002}));
  const ToolContact c = stroke.move(scalpel({0.0003, 0.0004, -0.003}));
  ASSERT_EQ(c[ToolSegment::ab].after.size(), 1u);
  ASSERT_EQ(c[ToolSegment::ac].after.size(), 1u);
  EXPECT_TRUE(c[ToolSegment::bd].after.empty());
  EXPECT_TRUE(c[ToolSegment::cd].after.empty());
  EXPECT_FALSE(c[ToolSegment::ab].after[0].entering) << "A is inside, B outside";
  EXPECT_NEAR(c[ToolSegment::ab].after[0].parameter, 0.1, 1e-9);
  EXPECT_NEAR(c[ToolSegment::ac].after[0].point_world_m.x(), 0.0003 + 0.0015, 1e-9);
  ASSERT_EQ(c.path(ToolCorner::a).size(), 1u);
  EXPECT_TRUE(c.path(ToolCorner::a)[0].entering);
  EXPECT_NEAR(c.path(ToolCorner::a)[0].parameter, 0.4, 1e-9);
  EXPECT_EQ(stroke.missed, 0);
}

TEST(B_CD, B_CD_11_one_global_search_in_a_quasi_static_cut) {
  const SurfaceBody body = pad();
  Stroke stroke(body);
  for (int k = 0; k <= 60; ++k) stroke.move(scalpel({-0.04 + 0.00013, 0.00021, 0.003 - 0.0001 * k}));
  for (int k = 0; k <= 600; ++k) stroke.move(scalpel({-0.04 + 0.0001 * k + 0.00013, 0.00021 + 0.00002 * k, -0.003}));
  EXPECT_EQ(stroke.counters().global_searches, 1u);
  EXPECT_GE(stroke.counters().local_searches, 600u);
  EXPECT_EQ(stroke.missed, 0);
  EXPECT_GT(stroke.edges, 40u);
}

TEST(B_CD, B_CD_11_fast_motion_and_dropped_samples_fall_back_to_global) {
  const SurfaceBody body(organ(24));
  Random random(1);
  int touched = 0;
  for (int run = 0; run < 12; ++run) {
    Stroke stroke(body);
    const double y = uniform(random, -0.02, 0.02), z = uniform(random, 0.02, 0.045);
    for (int k = 0; k < 24; ++k) stroke.move(scalpel({-0.06 + 0.005 * k, y, z}), k % 3 != 0);
    EXPECT_EQ(stroke.missed, 0);
    EXPECT_GE(stroke.counters().global_searches, static_cast<std::uint64_t>(stroke.touched) / 3);
    touched += stroke.touched;
  }
  EXPECT_GT(touched, 100);
  Stroke fast(body);
  fast.move(scalpel({-0.06, 0, 0.03}));
  for (int k = 1; k < 12; ++k) fast.move(scalpel({-0.06 + 0.01 * k, 0, 0.03}));
  EXPECT_EQ(fast.counters().local_searches, 0u);
  EXPECT_EQ(fast.missed, 0);
}

// The instrument follows one sheet, and its tip comes through to another that the walk cannot reach.
TEST(FrontTracker, second_sheet_reached_later) {
  std::vector<Corners> triangles;
  add_box(triangles, Vec3(-0.06, -0.03, -0.004), Vec3(0.06, 0.03, 0), {40, 20, 2});
  add_box(triangles, Vec3(-0.01, -0.03, -0.012), Vec3(0.06, 0.03, -0.006), {23, 20, 3});
  const SurfaceBody body(weld(triangles));
  Stroke stroke(body);
  for (int k = 0; k < 10; ++k) stroke.move(scalpel({-0.04, 0.00021, 0.001 - 0.0009 * k}));
  const auto before = stroke.counters().global_searches;
  ToolContact last;
  bool told = false;
  for (int k = 0; k < 200; ++k) {
    last = stroke.move(scalpel({-0.04 + 0.00026 * k, 0.00021, -0.0071}));
    told = told || last.searched_globally;
  }
  EXPECT_EQ(stroke.missed, 0);
  EXPECT_TRUE(told);
  EXPECT_GT(stroke.counters().global_searches, before);
  EXPECT_EQ(last[ToolSegment::ab].after.size(), 3u) << "out of the lower piece, into and out of the upper";
}

// A fold thinner than a step: the segment is outside before and after the step, and has passed through.
TEST(FrontTracker, thin_fold_is_not_jumped_over) {
  std::vector<Corners> triangles;
  add_box(triangles, Vec3(-0.0002, -0.03, -0.03), Vec3(0.0002, 0.03, 0.03), {1, 20, 20});
  const SurfaceBody body(weld(triangles));
  Stroke stroke(body);
  stroke.move(scalpel({-0.0085, 0.0003, -0.001}));
  const ToolContact c = stroke.move(scalpel({0.0015, 0.0003, -0.001}));
  EXPECT_TRUE(c[ToolSegment::ab].after.empty());
  EXPECT_TRUE(c[ToolSegment::ab].before.empty());
  ASSERT_EQ(c.path(ToolCorner::a).size(), 2u);
  EXPECT_TRUE(c.path(ToolCorner::a)[0].entering);
  EXPECT_FALSE(c.path(ToolCorner::a)[1].entering);
  EXPECT_GT(c[ToolSegment::ab].swept.size(), 10u);
  EXPECT_EQ(stroke.missed, 0);
}

// The tip moves along vertices and edges, with corners of its path exactly on them: its crossings alternate.
TEST(FrontTracker, strokes_through_vertices_and_along_edges) {
  const SurfaceBody body = pad();
  const auto on_grid = [](double steps_of_3_mm) {
    return static_cast<double>(static_cast<float>(0.003 * steps_of_3_mm));
  };
  for (const double row : {0.0, 1.0, 0.5}) {
    Stroke stroke(body);
    int depth = 0;
    for (int k = 0; k <= 120; ++k) {
      const double z = 0.002 * ((k / 2) % 2 ? -1 : k % 2 ? 0 : 1);  // out, on, in, in, ...
      const double x = on_grid(-15 + std::floor(0.25 * k)) + 0.25 * (k % 4) * on_grid(1);
      const ToolContact c = stroke.move(scalpel({x, on_grid(row), z}));
      for (const SurfaceHit& hit : c.path(ToolCorner::a)) {
        depth += hit.entering ? 1 : -1;
        ASSERT_TRUE(depth == 0 || depth == 1) << k;
      }
      EXPECT_LE(c[ToolSegment::ab].after.size(), 1u);
    }
    EXPECT_EQ(stroke.missed, 0);
    EXPECT_GT(stroke.touched, 80);
  }
}

// A segment that goes over the surface leaves the triangle that it pierced, over edges, to the one that it pierces
// next.
TEST(FrontTracker, swept_edges_lead_from_triangle_to_triangle) {
  const SurfaceBody body(organ(24));
  Stroke stroke(body);
  Random random(2);
  int paths = 0, edges = 0;
  for (int k = 0; k < 300; ++k) {
    const Vec3 tip(-0.02 + 0.00015 * k, 0.003 * std::sin(0.05 * k), 0.038);
    const SegmentContact c = stroke.move(scalpel(tip))[ToolSegment::ac];
    if (c.before.size() != 1 || c.after.size() != 1) continue;
    TriangleId at = c.before[0].triangle;
    for (const EdgeCrossing& e : c.swept) {
      const TriangleId other = body.mesh.neighbour(e.triangle, e.edge);
      ASSERT_TRUE(at == e.triangle || at == other) << k;
      at = at == e.triangle ? other : e.triangle;
      ++edges;
    }
    EXPECT_EQ(at, c.after[0].triangle) << k;
    ++paths;
  }
  EXPECT_GT(paths, 200);
  EXPECT_GT(edges, 20);
}

// Random tools at random speeds over a surface that deforms and changes its topology: there is never a difference.
TEST(FrontTracker, random_strokes_agree_with_every_triangle) {
  Random random(3);
  int touched = 0, missed = 0;
  std::uint64_t local = 0;
  for (int run = 0; run < 100; ++run) {
    SurfaceBody body(organ(8));
    Stroke stroke(body);
    Vec3 tip = uniform_vec(random, -0.05, 0.05);
    const double speed = std::array<double, 4>{0.0001, 0.0007, 0.003, 0.012}[below(random, 4)];
    Vec3 direction = -tip.normalized() + 0.7 * uniform_vec(random, -1, 1);
    const Eigen::Quaterniond turn =
        Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), uniform_vec(random, -1, 1).normalized());
    for (int k = 0; k < 80; ++k) {
      direction = (direction + 0.3 * uniform_vec(random, -1, 1) - 4 * tip).normalized();
      tip += speed * direction;
      ToolCorners tool = scalpel(Vec3::Zero());
      for (Vec3& corner : tool.at_world_m) corner = tip + turn * corner;
      const auto contact = stroke.move(tool, random() % 10 != 0);
      if (k % 5 == 0) {
        for (Vec3f& x : body.x) x += uniform_vec(random, -0.0004, 0.0004).cast<float>();
        stroke.tree().update_moved(body.view());
      }
      if (const auto& hits = contact[ToolSegment::ab].after; !hits.empty()) {
        const SurfaceHit& hit = hits[0];
        const auto& v = body.mesh.triangle(hit.triangle).v;
        const Vec3 rest = hit.bary[0] * body.mesh.rest_body_m(v[0]) + hit.bary[1] * body.mesh.rest_body_m(v[1]) +
                          hit.bary[2] * body.mesh.rest_body_m(v[2]);
        const TopologyDelta delta = split(body.mesh, hit.triangle, rest);
        ASSERT_EQ(apply(delta, body.mesh), ApplyStatus::applied);
        body.x.push_back(hit.point_world_m.cast<float>());
        stroke.tree().update_changed(body.view(), slots_of(delta));
        stroke.tracker().topology_changed(body.view(), slots_of(delta));
      }
    }
    touched += stroke.touched;
    missed += stroke.missed;
    local += stroke.counters().local_searches;
  }
  EXPECT_EQ(missed, 0);
  EXPECT_GT(touched, 2000);
  EXPECT_GT(local, 1000u);
}

TEST(FrontTracker, far_away_searches_nothing) {
  const SurfaceBody body(organ(8));
  Stroke stroke(body);
  for (int k = 0; k < 50; ++k) stroke.move(scalpel({0.1 + 0.0001 * k, 0, 0.1}));
  EXPECT_EQ(stroke.counters().global_searches + stroke.counters().local_searches, 0u);
}

}  // namespace
}  // namespace sectio::collision_test

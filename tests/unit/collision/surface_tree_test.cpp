#include "sim_server/collision/surface_tree.h"

#include <gtest/gtest.h>

#include "tests/unit/collision/surfaces.h"

namespace sectio::collision_test {
namespace {

void expect_same_as_every_triangle(const SurfaceBody& body, const SurfaceTree& tree, Random& random, int queries) {
  const SurfaceView view = body.view();
  ASSERT_EQ(tree.size(), body.mesh.triangle_count());
  for (int k = 0; k < queries; ++k) {
    Vec3 p = uniform_vec(random, -0.08, 0.08), q = uniform_vec(random, -0.08, 0.08);
    if (k % 3 == 1) {  // through a vertex
      const TriangleId t = static_cast<TriangleId>(below(random, body.mesh.triangle_slots()));
      if (body.mesh.triangle(t).alive()) q = p + 1.5 * (view.corner(t, 0) - p);
    }
    if (k % 3 == 2) q = p + 0.1 * (q - p);
    const auto expected = every_hit(view, p, q);
    ASSERT_TRUE(same(tree.hits(view, p, q), expected)) << k;
    const auto first = tree.first_hit(view, p, q);
    ASSERT_EQ(first.has_value(), !expected.empty());
    if (first) {
      ASSERT_EQ(first->triangle, expected[0].triangle);
    }
    const SweptSegment sweep{p, q, p + uniform_vec(random, -0.01, 0.01), q + uniform_vec(random, -0.01, 0.01)};
    ASSERT_TRUE(same(tree.swept(view, sweep), cross_edges(view, every_triangle(body.mesh), sweep))) << k;
  }
}

TEST(SurfaceTree, agrees_with_every_triangle) {
  Random random(1);
  const SurfaceBody body(organ(12));
  expect_same_as_every_triangle(body, SurfaceTree(body.view()), random, 400);
}

TEST(SurfaceTree, hits_say_what_and_where) {
  Random random(2);
  const SurfaceBody body(organ(10));
  const SurfaceTree tree(body.view());
  int found = 0;
  for (int k = 0; k < 200; ++k) {
    const Vec3 p = 0.1 * uniform_vec(random, -1, 1).normalized(), q = uniform_vec(random, -0.01, 0.01);
    for (const SurfaceHit& hit : tree.hits(body.view(), p, q)) {
      ++found;
      const Corners t = body.view().corners(hit.triangle);
      EXPECT_EQ(hit.body, 7u);
      EXPECT_NEAR(hit.bary.sum(), 1, 1e-12);
      EXPECT_GE(hit.bary.minCoeff(), 0);
      EXPECT_LT((hit.bary[0] * t[0] + hit.bary[1] * t[1] + hit.bary[2] * t[2] - hit.point_world_m).norm(), 1e-15);
      EXPECT_LT((p + hit.parameter * (q - p) - hit.point_world_m).norm(), 1e-12);
      EXPECT_NEAR(hit.normal_world.norm(), 1, 1e-12);
      EXPECT_EQ(hit.entering, hit.normal_world.dot(q - p) < 0);
    }
  }
  EXPECT_GE(found, 200);
}

TEST(SurfaceTree, follows_positions) {
  Random random(3);
  SurfaceBody body(organ(10));
  SurfaceTree tree(body.view());
  for (int round = 0; round < 60; ++round) {
    const double size = round % 3 == 0 ? 0.0001 : 0.003;
    if (round % 2) {
      for (Vec3f& x : body.x) x += uniform_vec(random, -size, size).cast<float>();
      tree.update_moved(body.view());
    } else {  // some, named
      std::vector<VertexId> moved;
      for (int k = 0; k < 20; ++k) {
        moved.push_back(static_cast<VertexId>(below(random, body.x.size())));
        body.x[moved.back()] += uniform_vec(random, -size, size).cast<float>();
      }
      tree.update_moved(body.view(), moved);
    }
    expect_same_as_every_triangle(body, tree, random, 12);
  }
}

TEST(SurfaceTree, small_motions_cost_nothing_and_large_ones_are_seen) {
  SurfaceBody body(organ(6));
  SurfaceTree tree(body.view(), 0.001);
  for (Vec3f& x : body.x) x += Vec3f::Constant(0.0009f);
  EXPECT_EQ(tree.update_moved(body.view()), 0u);
  for (Vec3f& x : body.x) x += Vec3f::Constant(0.0009f);
  EXPECT_EQ(tree.update_moved(body.view()), body.x.size());
  EXPECT_EQ(tree.update_moved(body.view()), 0u);
}

TEST(SurfaceTree, right_after_thousands_of_local_edits) {
  Random random(4);
  SurfaceBody body(organ(6));
  SurfaceTree tree(body.view());
  std::vector<VertexId> added;
  int applied = 0;
  for (int k = 0; k < 6000; ++k) {
    TopologyDelta delta;
    if (added.empty() || random() % 5 < 3) {
      const TriangleId t = static_cast<TriangleId>(below(random, body.mesh.triangle_slots()));
      if (!body.mesh.triangle(t).alive()) continue;
      const auto& v = body.mesh.triangle(t).v;
      delta = split(body.mesh, t,
                    (body.mesh.rest_body_m(v[0]) + body.mesh.rest_body_m(v[1]) + body.mesh.rest_body_m(v[2])) / 3 +
                        uniform_vec(random, -0.0005, 0.0005));
      added.push_back(delta.vertices[0].id);
    } else {
      const std::size_t i = below(random, added.size());
      const VertexId v = added[i];
      int valence = 0;
      for ([[maybe_unused]] const TriangleId t : body.mesh.fan(v)) ++valence;
      if (valence != 3) continue;
      delta = unsplit(body.mesh, v);
      added.erase(added.begin() + static_cast<std::ptrdiff_t>(i));
    }
    const TopologyDelta back = inverse(delta, body.mesh);
    ASSERT_EQ(apply(delta, body.mesh), ApplyStatus::applied) << k;
    body.x.resize(body.mesh.vertex_slots());
    for (const VertexEdit& e : delta.vertices)
      if (e.alive) body.x[e.id] = e.rest_body_m.cast<float>();
    tree.update_changed(body.view(), slots_of(delta));
    ++applied;
    if (k % 7 == 0 && delta.vertices[0].alive) {  // temporary subdivision does so; slots at the end vanish again
      const Vec3f x = body.x[delta.vertices[0].id];
      const TopologyDelta again = inverse(back, body.mesh);
      ASSERT_EQ(apply(back, body.mesh), ApplyStatus::applied);
      body.x.resize(body.mesh.vertex_slots());
      tree.update_changed(body.view(), slots_of(back));
      expect_same_as_every_triangle(body, tree, random, 1);
      TopologyDelta redo = again;
      redo.base_revision = body.mesh.revision();
      redo.revision = redo.base_revision + 1;
      ASSERT_EQ(apply(redo, body.mesh), ApplyStatus::applied);
      body.x.resize(body.mesh.vertex_slots());
      body.x[redo.vertices[0].id] = x;
      tree.update_changed(body.view(), slots_of(redo));
    }
    if (k % 50 == 0) expect_same_as_every_triangle(body, tree, random, 6);
  }
  EXPECT_GT(applied, 3000);
  expect_same_as_every_triangle(body, tree, random, 300);
}

// New leaves that are inserted side by side would turn the tree into a list.
TEST(SurfaceTree, a_long_stroke_keeps_the_tree_shallow) {
  SurfaceBody body(organ(6));
  SurfaceTree tree(body.view());
  TriangleId last = 0;
  for (int k = 0; k < 4000; ++k) {
    const auto& v = body.mesh.triangle(last).v;
    const Vec3 p =
        0.98 * body.mesh.rest_body_m(v[0]) + 0.01 * body.mesh.rest_body_m(v[1]) + 0.01 * body.mesh.rest_body_m(v[2]);
    const TopologyDelta delta = split(body.mesh, last, p);
    ASSERT_EQ(apply(delta, body.mesh), ApplyStatus::applied);
    body.x.push_back(p.cast<float>());
    tree.update_changed(body.view(), slots_of(delta));
    last = delta.triangles.back().id;
  }
  EXPECT_LE(tree.depth(), 2 * 14 + 18u);
  Random random(5);
  expect_same_as_every_triangle(body, tree, random, 60);
}

TEST(SurfaceTree, inside_and_closest) {
  Random random(6);
  const SurfaceBody body(organ(14, 0));  // a ball
  const SurfaceTree tree(body.view());
  for (int k = 0; k < 1000; ++k) {
    Vec3 p = uniform_vec(random, -0.06, 0.06);
    if (k % 2) p = Vec3(std::round(p.x() * 20) / 400, 0, 0) + Vec3(0, 0.05, 0) * std::round(uniform(random, -1, 1));
    const double r = p.norm();
    if (r < 0.049) {
      EXPECT_TRUE(tree.inside(body.view(), p)) << p.transpose();
    }
    if (r > 0.0501) {
      EXPECT_FALSE(tree.inside(body.view(), p)) << p.transpose();
    }
    const auto closest = tree.closest(body.view(), p, 0.01);
    if (r > 0.0501 && r < 0.059) {
      ASSERT_TRUE(closest);
      EXPECT_NEAR(closest->distance_m, r - 0.05, 0.0006);
    }
    if (r < 0.035) {
      EXPECT_FALSE(closest);
    }
    if (!closest) continue;
    double best = 1;
    for (const TriangleId t : every_triangle(body.mesh))
      best = std::min(best, closest_on_triangle(p, body.view().corners(t)).squared_distance);
    EXPECT_EQ(closest->distance_m, std::sqrt(best));
  }
}

TEST(SurfaceTree, of_nothing) {
  const TriangleMesh mesh;
  const SurfaceView view{mesh, {}};
  SurfaceTree tree(view);
  EXPECT_EQ(tree.size(), 0u);
  EXPECT_TRUE(tree.hits(view, Vec3::Zero(), Vec3::Ones()).empty());
  EXPECT_FALSE(tree.inside(view, Vec3::Zero()));
  EXPECT_EQ(tree.update_moved(view), 0u);
}

}  // namespace
}  // namespace sectio::collision_test

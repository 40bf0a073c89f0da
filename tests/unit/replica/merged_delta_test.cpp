// Deltas of real strokes as one: they lead to the same mesh, with fewer edits; and a queue finds the way through both.
#include "common/delta/merged_delta.h"

#include <gtest/gtest.h>

#include "common/delta/delta_queue.h"
#include "common/mesh/check.h"
#include "tests/support/operation.h"
#include "tests/support/random.h"

namespace sectio::test {
namespace {

std::size_t edits_of(const TopologyDelta& delta) {
  return delta.vertices.size() + delta.triangles.size();
}

// The deltas of a scalpel or a probe on an organ, in order, and the mesh before them.
struct Stroke {
  explicit Stroke(bool probe) {
    Scene scene = organ_scene();
    if (probe) {
      scene.bodies[0].contact.style = "templates";
      scene.tools[0].kind = "probe";
      scene.tools[0].geometry = instrument_of("probe").geometry;
    }
    Operation op(scene);
    before = op.mesh();
    op.after_each = [&](const StepOutput& out) {
      for (const BodyDelta& delta : out.deltas) deltas.push_back(delta.delta);
    };
    op.place(Vec3(-0.02, 0, kOrganTop_m + 0.005));
    op.tip_to(-0.02, 0, kStrokeDepth_m);
    op.tip_to(0.02, 0.005, kStrokeDepth_m, 0.05);
    op.move(op.hand().position_m + Vec3(0, 0, 0.02));
    after = op.mesh();
  }
  TriangleMesh before, after;
  std::vector<TopologyDelta> deltas;
};

TEST(MergedDelta, deltas_of_a_stroke_in_groups_of_any_size_lead_to_the_same_mesh) {
  for (const bool probe : {false, true}) {
    const Stroke stroke(probe);
    ASSERT_GT(stroke.deltas.size(), 100u);
    test::Random random(7);
    for (const unsigned most : {1u, 16u, 300u}) {
      TriangleMesh one_by_one = stroke.before, merged_mesh = stroke.before;
      MergedDelta merged;
      std::size_t edits = 0, merged_edits = 0;
      const auto flush = [&] {
        if (merged.empty()) return;
        const TopologyDelta delta = merged.take();
        merged_edits += edits_of(delta);
        ASSERT_EQ(apply(delta, merged_mesh), ApplyStatus::applied);
        ASSERT_TRUE(merged_mesh.same_database(one_by_one));
        ASSERT_EQ(merged_mesh.revision(), one_by_one.revision());
        ASSERT_EQ(merged_mesh.has_temporary_elements(), one_by_one.has_temporary_elements());
      };
      for (const TopologyDelta& delta : stroke.deltas) {
        if (!merged.add(delta, one_by_one)) {
          flush();
          ASSERT_TRUE(merged.add(delta, one_by_one));
        }
        ASSERT_EQ(apply(delta, one_by_one), ApplyStatus::applied);
        edits += edits_of(delta);
        if (random() % most == 0) flush();
      }
      flush();
      EXPECT_TRUE(merged_mesh.same_database(stroke.after));
      EXPECT_TRUE(check(merged_mesh).valid());
      if (most >= 16) {
        EXPECT_LT(4 * merged_edits, edits) << most << (probe ? ", probe" : ", scalpel");
      }
    }
  }
}

TEST(DeltaQueue, finds_the_way_through_single_and_merged_deltas_but_never_beyond_the_goal) {
  const auto delta = [](std::uint64_t from, std::uint64_t to) {
    TopologyDelta d;
    d.base_revision = from;
    d.revision = to;
    return d;
  };
  DeltaQueue queue;
  queue.add(delta(5, 9));
  EXPECT_TRUE(queue.links(5, 9));
  EXPECT_FALSE(queue.links(5, 7));
  for (std::uint64_t r : {6, 5, 7}) queue.add(delta(r, r + 1));
  EXPECT_TRUE(queue.links(5, 7));
  EXPECT_TRUE(queue.links(6, 8));
  EXPECT_FALSE(queue.links(6, 9)) << "8 to 9 is missing";
  EXPECT_EQ(queue.next(5)->revision, 9u);
  EXPECT_EQ(queue.next(5, 8)->revision, 6u);
  queue.forget_before(6);
  EXPECT_EQ(queue.size(), 2u);
  EXPECT_EQ(queue.next(5), nullptr);
}

}  // namespace
}  // namespace sectio::test

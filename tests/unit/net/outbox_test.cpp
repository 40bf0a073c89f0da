#include "sim_server/net/outbox.h"

#include <gtest/gtest.h>

#include "tests/support/moving_world.h"

namespace sectio::net_test {
namespace {

TEST(A_ARCH, A_ARCH_6_a_server_that_nobody_reads_from_keeps_bodies_instead_of_ever_more_deltas) {
  test::MovingWorld world(0);
  TriangleMesh published = world.mesh();
  const std::vector<BodyInfo> infos = world.scene("").bodies;
  Outbox box;
  std::size_t most = 0;
  while (!box.meshes || box.deltas.size() < 3) {
    const StepOutput output = world.step(true);
    box.put(output, world.view(), infos, 0, false);
    most = std::max(most, box.deltas.size());
    ASSERT_LT(world.steps(), 20000u) << "no limit";
  }
  EXPECT_GT(most, 10000u);
  published = box.meshes->at(0);
  for (const BodyDelta& delta : box.deltas) ASSERT_EQ(apply(delta.delta, published), ApplyStatus::applied);
  EXPECT_EQ(published.hash(), world.mesh().hash());
  EXPECT_EQ(box.snapshot.bodies.at(0).revision, world.mesh().revision());
}

TEST(A_ARCH, A_ARCH_6_a_state_lies_when_it_is_due) {
  test::MovingWorld world(0);
  const std::vector<BodyInfo> infos = world.scene("").bodies;
  Outbox box;
  const StepOutput output = world.step(false);
  box.put(output, world.view(), infos, 0, false);
  EXPECT_FALSE(box.urgent());
  EXPECT_FALSE(box.snapshot_fresh);
  box.put(output, world.view(), infos, 0, true);
  EXPECT_TRUE(box.urgent() && box.snapshot_fresh);

  Outbox next;
  next.go_on_from(box);
  EXPECT_EQ(next.step, output.step);
  box.clear();
  EXPECT_FALSE(box.urgent() || box.snapshot_fresh || next.urgent());
}

}  // namespace
}  // namespace sectio::net_test

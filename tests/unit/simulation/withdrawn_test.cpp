// An instrument for which nobody speaks any more leaves the tissue and is gone until its next sample.
#include <gtest/gtest.h>

#include "tests/support/gripper.h"

namespace sectio::test {
namespace {

StepInput withdrawal() {
  StepInput input;
  input.withdrawn = {0};
  return input;
}

TEST(Withdrawn, a_blade_in_tissue_leaves_it_without_cutting_and_begins_anew_with_its_next_sample) {
  Operation op(organ_scene());
  op.tip_to(-0.02, 0, -0.004);
  op.tip_to(-0.02, 0, 0.004);
  op.tip_to(0, 0, 0.004);
  ASSERT_EQ(op.state(), ContactState::penetration);
  const std::size_t walls = op.walls();
  ASSERT_GT(walls, 0u);
  op.step(withdrawal());
  op.rest(50);
  EXPECT_FALSE(op.simulation.tool_pose_world(0));
  EXPECT_TRUE(op.last.contacts.empty()) << "there is no hand";
  EXPECT_EQ(op.count(EventKind::instrument_withdrawn), 1u);
  EXPECT_EQ(op.count(EventKind::cut_ended), op.count(EventKind::penetrated));
  const std::size_t mended = op.walls();
  EXPECT_GT(mended, 0u);
  EXPECT_LE(mended, walls) << "slivers are mended, nothing is cut";
  op.expect_valid();
  op.step(withdrawal());
  EXPECT_EQ(op.count(EventKind::instrument_withdrawn), 1u) << "it has gone already";

  // From its last place to the next one the organ lies in between: nothing may be cut on that way.
  op.place(Vec3(0.04, 0, kOrganTop_m + 0.01));
  op.rest(5);
  ASSERT_TRUE(op.simulation.tool_pose_world(0));
  EXPECT_EQ(op.state(), ContactState::free);
  EXPECT_EQ(op.walls(), mended);
}

TEST(Withdrawn, a_blade_that_comes_back_in_tissue_cuts_nothing_until_it_has_been_out_of_it) {
  for (const bool was_there : {true, false}) {
    Operation op(organ_scene());
    if (was_there) op.place(Vec3(0, 0, kOrganTop_m + 0.01));
    op.step(withdrawal());
    op.rest(20);
    op.place(Vec3(-0.01, 0, kOrganTop_m - 0.004));
    EXPECT_EQ(op.count(EventKind::did_not_cut), 1u);
    op.move(Vec3(0.01, 0, kOrganTop_m - 0.004));
    EXPECT_EQ(op.walls(), 0u);
    EXPECT_EQ(op.state(), ContactState::free);
    EXPECT_EQ(op.force_n(), Vec3::Zero());
    op.tip_to(0.01, 0, -0.004);
    op.tip_to(0.01, 0, 0.004);
    op.tip_to(0.02, 0, 0.004);
    EXPECT_GT(op.walls(), 0u);
    EXPECT_EQ(op.count(EventKind::did_not_cut), 1u);
  }
}

TEST(Withdrawn, forceps_let_go) {
  Operation op(block_with_forceps("surface_springs"));
  Gripper gripper(op, 0, Vec3(0, 0, kBlockTop_m + 0.01));
  gripper.open();
  gripper.move(Vec3(0, 0, -0.011), 60);
  gripper.close();
  ASSERT_EQ(op.count(EventKind::grasped), 1u);
  op.step(withdrawal());
  EXPECT_EQ(op.count(EventKind::released), 1u);
  EXPECT_EQ(text_of_last(op, EventKind::released), "withdrawn");
  op.rest(5);
  EXPECT_FALSE(op.simulation.tool_pose_world(0));
}

TEST(Withdrawn, an_instrument_with_a_sample_in_the_step_stays) {
  Operation op(organ_scene());
  op.place(Vec3(0, 0, kOrganTop_m + 0.01));
  StepInput input = withdrawal();
  input.samples.push_back(op.sample(0, op.hand()));
  op.step(input);
  op.rest(3);
  EXPECT_TRUE(op.simulation.tool_pose_world(0));
  EXPECT_EQ(op.count(EventKind::instrument_withdrawn), 0u);
}

}  // namespace
}  // namespace sectio::test

#include "sim_server/net/budget.h"

#include <gtest/gtest.h>

namespace sectio::net_test {
namespace {

TEST(A_ARCH, A_ARCH_6_a_session_that_is_late_is_deferred_by_few_frames_then_reduced_then_slowed) {
  BudgetPlanner planner;
  EXPECT_EQ(planner.plan(-0.001), Budget::kept);
  EXPECT_EQ(planner.plan(0.010), Budget::kept) << "less than a frame";
  EXPECT_EQ(planner.plan(0.030), Budget::deferred);
  EXPECT_FALSE(planner.changed());
  EXPECT_EQ(planner.plan(0.080), Budget::reduced);
  EXPECT_TRUE(planner.changed());
  EXPECT_EQ(planner.plan(0.030), Budget::reduced) << "until less than a frame is left";
  EXPECT_FALSE(planner.changed());
  EXPECT_EQ(planner.plan(0.010), Budget::kept);
  EXPECT_TRUE(planner.changed());
  EXPECT_EQ(planner.plan(0.300), Budget::slowed);
  EXPECT_EQ(planner.plan(0.000), Budget::kept);
  EXPECT_EQ(planner.steps(Budget::reduced), 2u);
  EXPECT_EQ(planner.most_behind_s(), 0.3);
}

TEST(A_ARCH, A_ARCH_6_where_nothing_may_be_reduced_late_steps_are_deferred_until_the_clock_is_set_back) {
  BudgetPlanner planner(false);
  EXPECT_EQ(planner.plan(0.080), Budget::deferred);
  EXPECT_EQ(planner.plan(0.300), Budget::slowed);
  EXPECT_EQ(planner.plan(0.080), Budget::deferred);
}

TEST(A_ARCH, A_ARCH_6_nothing_is_deferred_by_more_than_few_frames) {
  BudgetPlanner planner;
  for (double behind_s = 0; behind_s < 1; behind_s += 0.001)
    EXPECT_EQ(planner.plan(behind_s) == Budget::deferred,
              behind_s > BudgetPlanner::kFrame_s && behind_s <= BudgetPlanner::kFewFrames * BudgetPlanner::kFrame_s)
        << behind_s;
}

}  // namespace
}  // namespace sectio::net_test

#include "sim_server/net/answer_pace.h"

#include <gtest/gtest.h>

namespace sectio {
namespace {

// By value: take() numbers it.
bool takes(AnswerPace& pace, ContactModel model, double now_s) {
  return pace.take(model, now_s);
}
ContactModel answer(double tool_time_s, ContactState state = ContactState::contact, std::uint32_t tool_id = 0) {
  ContactModel model;
  model.tool_id = tool_id;
  model.tool_time_s = tool_time_s;
  model.state = state;
  return model;
}

TEST(AnswerPace, answers_each_pose_once_and_each_state_at_once) {
  AnswerPace pace;
  EXPECT_TRUE(takes(pace, answer(1), 10));
  EXPECT_FALSE(takes(pace, answer(1), 10.001));
  EXPECT_TRUE(takes(pace, answer(1, ContactState::penetration), 10.002));
  EXPECT_TRUE(takes(pace, answer(1.001, ContactState::penetration), 10.003));
  EXPECT_TRUE(takes(pace, answer(1, ContactState::contact, 1), 10.003)) << "another hand";
}

TEST(AnswerPace, a_hand_that_says_nothing_hears_of_the_tissue_fifty_times_a_second) {
  AnswerPace pace;
  int told = 0;
  for (int ms = 0; ms < 1000; ++ms) told += takes(pace, answer(1), 0.001 * ms);
  EXPECT_NEAR(told, 50, 3);
}

TEST(AnswerPace, numbers_without_holes) {
  AnswerPace pace;
  std::uint64_t last = 0;
  for (int step = 0; step < 100; ++step) {
    ContactModel model = answer(step / 3);
    model.sequence = 1000 + static_cast<std::uint64_t>(step);
    if (!pace.take(model, 0.001 * step)) continue;
    EXPECT_EQ(model.sequence, ++last);
  }
  EXPECT_GE(last, 33u);
}

}  // namespace
}  // namespace sectio

#include "sim_server/net/standbys.h"

#include <gtest/gtest.h>

#include <vector>

namespace sectio::net_test {
namespace {

constexpr ProgramId kFirst{1}, kSecond{2}, kThird{3};

TEST(Standbys, of_those_that_hear_each_other_have_an_order_in_which_each_has_a_place_of_its_own) {
  const std::uint64_t epoch = first_epoch(77) + 3;
  for (const std::vector<ProgramId>& heard : {std::vector{kFirst, kSecond, kThird}, {kThird, kFirst, kSecond}}) {
    Standbys known;
    for (const ProgramId& each : heard) known.hear(each, epoch, 10);
    EXPECT_EQ(known.before(kFirst, epoch, 10.1), 0u);
    EXPECT_EQ(known.before(kSecond, epoch, 10.1), 1u);
    EXPECT_EQ(known.before(kThird, epoch, 10.1), 2u);
  }
}

TEST(Standbys, that_have_gone_or_stand_by_for_another_session_let_nobody_wait) {
  const std::uint64_t epoch = first_epoch(77);
  Standbys known;
  known.hear(kFirst, epoch, 10);
  known.hear(kSecond, first_epoch(78), 10);
  EXPECT_EQ(known.before(kThird, epoch, 10.1), 1u);
  EXPECT_EQ(known.before(kThird, epoch + 1, 10.1), 1u) << "a later term of the session";
  EXPECT_EQ(known.before(kThird, epoch, 10.1 + Standbys::kPresence_s), 0u);
  EXPECT_EQ(known.count(10.1), 2u) << "of whichever session";
  EXPECT_EQ(known.count(10.1 + Standbys::kPresence_s), 0u);
  EXPECT_TRUE(known.has_heard(kFirst)) << "it may speak up for the session now";
  EXPECT_FALSE(known.has_heard(kThird));
}

TEST(Standbys, that_are_too_many_push_out_the_one_that_was_heard_longest_ago) {
  Standbys known;
  known.hear(kFirst, first_epoch(77), 10);
  known.hear(kSecond, first_epoch(77), 10);
  known.hear(kFirst, first_epoch(77), 11);
  for (std::uint8_t i = 1; i < Standbys::kMost; ++i) known.hear({9, i}, first_epoch(78), 12);
  EXPECT_TRUE(known.has_heard(kFirst));
  EXPECT_FALSE(known.has_heard(kSecond));
}

}  // namespace
}  // namespace sectio::net_test

#include "render_client/gateway/roles.h"

#include <gtest/gtest.h>

namespace sectio::gateway_test {
namespace {

struct Theatre : testing::Test {
  Roles roles{{"secret", ""}};
  std::uint32_t ada = roles.enter(), ben = roles.enter(), eve = roles.enter();

  void SetUp() override {
    roles.set_tools({"scalpel", "forceps"});
    EXPECT_TRUE(roles.hello(ada, {"Ada", "secret"}));
    EXPECT_TRUE(roles.hello(ben, {"Ben", "secret"}));
    EXPECT_TRUE(roles.hello(eve, {"Eve", ""}));
  }
  std::string act(std::uint32_t person, ClaimAction action, std::uint32_t to = kNobody, double now_s = 0) {
    return roles.act(person, {0, action, to}, now_s);
  }
};

TEST_F(Theatre, an_instrument_has_one_holder_whom_all_see) {
  EXPECT_EQ(act(ada, ClaimAction::claim), "");
  EXPECT_EQ(act(ben, ClaimAction::claim), "the scalpel is held by Ada");
  EXPECT_EQ(roles.roster_for(eve).holders, (std::vector<std::uint32_t>{ada, kNobody}));
  EXPECT_EQ(roles.roster_for(eve).you, eve);
}

TEST_F(Theatre, a_page_has_one_hand_which_puts_down_what_it_held) {
  act(ada, ClaimAction::claim);
  EXPECT_EQ(roles.act(ada, {1, ClaimAction::claim, kNobody}, 0), "");
  EXPECT_EQ(roles.roster_for(eve).holders, (std::vector<std::uint32_t>{kNobody, ada}));
  EXPECT_EQ(roles.take_freed(), std::vector<std::uint32_t>{0});
  EXPECT_EQ(roles.act(ada, {1, ClaimAction::claim, kNobody}, 1), "") << "its own";
  EXPECT_EQ(roles.holder(1), ada);
}

TEST_F(Theatre, who_gives_no_name_is_a_guest_with_a_number) {
  const std::uint32_t one = roles.enter(), other = roles.enter();
  roles.hello(one, {"", "secret"});
  roles.hello(other, {"", "secret"});
  const Roster roster = roles.roster_for(one);
  EXPECT_NE(roster.people[3].name, roster.people[4].name);
  EXPECT_EQ(roster.people[3].name.substr(0, 6), "guest ");
}

TEST_F(Theatre, the_loser_is_told) {
  act(ada, ClaimAction::claim);
  EXPECT_EQ(act(ben, ClaimAction::take), "");
  EXPECT_EQ(roles.holder(0), ben);
  const auto notices = roles.take_notices();
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_EQ(notices[0], std::pair(ada, std::string("Ben has taken the scalpel from you")));
  EXPECT_FALSE(roles.heard(ada, 0, 1)) << "a wish of who has lost it counts no more";
  EXPECT_TRUE(roles.heard(ben, 0, 1));
}

TEST_F(Theatre, who_only_watches_neither_holds_nor_is_given_anything) {
  EXPECT_NE(act(eve, ClaimAction::claim), "");
  EXPECT_NE(act(eve, ClaimAction::take), "");
  act(ada, ClaimAction::claim);
  EXPECT_NE(act(ada, ClaimAction::give, eve), "");
  EXPECT_NE(act(ada, ClaimAction::give, 99), "");
  EXPECT_EQ(roles.holder(0), ada);
  EXPECT_EQ(act(ada, ClaimAction::give, ben), "");
  EXPECT_EQ(roles.holder(0), ben);
  EXPECT_NE(act(eve, ClaimAction::release), "");
}

TEST_F(Theatre, a_wrong_token_watches) {
  EXPECT_FALSE(roles.hello(ada, {"Ada", "guess"}));
  EXPECT_NE(act(ada, ClaimAction::claim), "");
}

TEST_F(Theatre, a_silent_hand_loses_its_instrument_and_all_are_told) {
  act(ada, ClaimAction::claim, kNobody, 10);
  roles.heard(ada, 0, 11);
  roles.tick(11 + 0.9 * Roles::kHandSilence_s);
  EXPECT_EQ(roles.holder(0), ada);
  roles.tick(11 + 1.1 * Roles::kHandSilence_s);
  EXPECT_EQ(roles.holder(0), kNobody);
  EXPECT_EQ(roles.take_freed(), std::vector<std::uint32_t>{0});
  const auto notices = roles.take_notices();
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_EQ(notices[0].first, kNobody);
}

TEST_F(Theatre, no_hand_is_blamed_for_the_sleep_of_the_gateway) {
  act(ada, ClaimAction::claim, kNobody, 10);
  roles.tick(10.1);
  roles.tick(20);
  EXPECT_EQ(roles.holder(0), ada);
}

TEST_F(Theatre, who_leaves_leaves_everything_behind) {
  act(ada, ClaimAction::claim);
  roles.leave(ada);
  EXPECT_EQ(roles.holder(0), kNobody);
  EXPECT_EQ(roles.roster_for(ben).people.size(), 2u);
  EXPECT_EQ(act(ben, ClaimAction::claim), "");
}

TEST_F(Theatre, who_holds_what_a_new_session_has_no_more_is_told) {
  act(ada, ClaimAction::claim);
  roles.set_tools({"scalpel", "probe"});
  EXPECT_EQ(roles.holder(0), ada);
  roles.set_tools({"probe"});
  EXPECT_EQ(roles.holder(0), kNobody);
  const auto notices = roles.take_notices();
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_EQ(notices[0], std::pair(ada, std::string("you hold the scalpel no more: the session has others now")));
}

TEST_F(Theatre, people_of_one_name_are_told_apart_by_a_number) {
  EXPECT_TRUE(roles.hello(ben, {"Ada", "secret"}));
  EXPECT_EQ(act(ben, ClaimAction::claim), "");
  EXPECT_EQ(act(ada, ClaimAction::claim), "the scalpel is held by Ada (2)");
  EXPECT_TRUE(roles.hello(ben, {"Ada", "secret"}));
  EXPECT_EQ(roles.name_of(ben), "Ada (2)") << "the same person";
  const std::string longest(kMaxNameBytes, 'a');
  for (const std::uint32_t person : {ada, ben}) EXPECT_TRUE(roles.hello(person, {longest, "secret"}));
  EXPECT_EQ(roles.name_of(ben), longest);
}

TEST(Roles, who_knows_the_leading_token_leads_and_gives_what_others_hold) {
  Roles roles{{"theatre", "professor"}};
  const std::uint32_t ada = roles.enter(), ben = roles.enter(), eve = roles.enter();
  roles.set_tools({"scalpel"});
  EXPECT_TRUE(roles.hello(ada, {"Ada", "professor"}));
  EXPECT_TRUE(roles.hello(ben, {"Ben", "theatre"}));
  EXPECT_TRUE(roles.hello(eve, {"Eve", ""}));
  EXPECT_TRUE(roles.may_lead(ada));
  EXPECT_FALSE(roles.may_lead(ben) || roles.may_lead(eve) || roles.may_lead(99));
  EXPECT_EQ(roles.act(ada, {0, ClaimAction::give, ben}, 0), "");
  EXPECT_EQ(roles.holder(0), ben);
  EXPECT_NE(roles.act(ben, {0, ClaimAction::give, eve}, 0), "");
  EXPECT_EQ(roles.act(ada, {0, ClaimAction::give, ada}, 0), "");
  EXPECT_EQ(roles.holder(0), ada);
}

TEST(Roles, who_leads_has_an_instrument_put_down_and_its_holder_is_told) {
  Roles roles{{"theatre", "professor"}};
  const std::uint32_t ada = roles.enter(), ben = roles.enter();
  roles.set_tools({"scalpel"});
  roles.hello(ada, {"Ada", "professor"});
  roles.hello(ben, {"Ben", "theatre"});
  EXPECT_EQ(roles.act(ada, {0, ClaimAction::claim, kNobody}, 0), "");
  EXPECT_NE(roles.act(ben, {0, ClaimAction::release, kNobody}, 0), "");
  EXPECT_EQ(roles.act(ada, {0, ClaimAction::give, ben}, 0), "");
  roles.take_notices();
  EXPECT_EQ(roles.act(ada, {0, ClaimAction::release, kNobody}, 0), "");
  EXPECT_EQ(roles.holder(0), kNobody);
  EXPECT_EQ(roles.take_notices(),
            (std::vector{std::pair(ben, std::string("Ada has put down the scalpel that you held"))}));
}

}  // namespace
}  // namespace sectio::gateway_test

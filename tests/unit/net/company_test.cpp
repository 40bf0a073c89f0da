#include "sim_server/net/company.h"

#include <gtest/gtest.h>

namespace sectio {
namespace {

TEST(Company, nobody_keeps_a_standby_from_going_on_alone) {
  EXPECT_TRUE(Company().shows_that_it_is_gone(10, 10.1));
  Company company;
  company.hear_hand(1);
  company.hear_viewer(2);
  EXPECT_TRUE(company.shows_that_it_is_gone(10, 10.1)) << "they had left long before";
}

TEST(Company, a_hand_that_goes_on_shows_that_the_server_is_gone) {
  Company company;
  company.hear_hand(10.001);
  EXPECT_FALSE(company.shows_that_it_is_gone(10, 10.1)) << "it was on the way";
  company.hear_hand(10.09);
  EXPECT_TRUE(company.shows_that_it_is_gone(10, 10.1));
}

TEST(Company, a_standby_that_hears_nobody_any_more_is_cut_off_itself) {
  Company company;
  company.hear_hand(10);
  company.hear_viewer(9.7);
  for (const double silence_s : {0.1, 1.0, 100.0})
    EXPECT_FALSE(company.shows_that_it_is_gone(10, 10 + silence_s)) << silence_s;
  company.hear_viewer(60);
  EXPECT_TRUE(company.shows_that_it_is_gone(10, 60)) << "the network is back, and the server isn't";
}

TEST(Company, viewers_are_believed_late) {
  Company company;
  company.hear_viewer(10.4);
  EXPECT_TRUE(company.shows_that_it_is_gone(10, 10.1)) << "where no hand was";
  company.hear_hand(10);
  EXPECT_FALSE(company.shows_that_it_is_gone(10, 10.4));
  EXPECT_TRUE(company.shows_that_it_is_gone(10, 10.1 + Company::kHandsGone_s));
}

}  // namespace
}  // namespace sectio

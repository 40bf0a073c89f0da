#include "sim_server/net/order_limit.h"

#include <gtest/gtest.h>

#include "sim_server/net/order.h"

namespace sectio::net_test {
namespace {

constexpr ProgramId kTeacher{1}, kStranger{2};

TEST(OrderLimit, a_person_who_clicks_quickly_is_always_heard) {
  OrderLimit limit;
  for (int click = 0; click < 300; ++click) EXPECT_TRUE(limit.allows(kTeacher, OrderKind::pause, 0.15 * click));
  for (int click = 0; click < 6; ++click) EXPECT_TRUE(limit.allows(kTeacher, OrderKind::begin_anew, 50 + 0.2 * click));
  for (int click = 0; click < 60; ++click) EXPECT_TRUE(limit.allows(kTeacher, OrderKind::seek, 60 + 1.1 * click));
  EXPECT_EQ(limit.refused(), 0u);
}

TEST(OrderLimit, a_flood_of_one_program_is_not_heard_until_it_is_quiet_and_takes_nothing_from_another) {
  OrderLimit limit;
  int anew = 0, others = 0;
  constexpr int kTen_s = 10000;
  for (int ms = 0; ms < kTen_s; ++ms) {
    const double now_s = 1e-3 * ms;
    anew += limit.allows(kStranger, OrderKind::begin_anew, now_s);
    others += limit.allows(kStranger, OrderKind::tilt, now_s);
    const bool is_heard = (ms % 500 != 0 || limit.allows(kTeacher, OrderKind::pause, now_s)) &&
                          (ms % 2000 != 0 || limit.allows(kTeacher, OrderKind::begin_anew, now_s));
    EXPECT_TRUE(is_heard) << now_s;
  }
  EXPECT_LE(anew, 9);  // a burst of eight, and the one that empties it
  EXPECT_LE(anew + others, 25);
  EXPECT_EQ(limit.refused(), 2u * kTen_s - static_cast<unsigned>(anew + others));
  EXPECT_FALSE(limit.allows(kStranger, OrderKind::pause, 1e-3 * kTen_s + 1));
  EXPECT_TRUE(limit.allows(kStranger, OrderKind::pause, 1e-3 * kTen_s + 1 + 2.1));
}

TEST(OrderLimit, many_programs_together_are_bounded_too) {
  OrderLimit limit;
  int heard = 0;
  for (int ms = 0; ms < 10000; ++ms)
    heard += limit.allows({static_cast<std::uint8_t>(ms % 200)}, OrderKind::begin_anew, 1e-3 * ms);
  EXPECT_LE(heard, 60);
}

TEST(Orders, one_that_leads_further_back_stands_for_the_one_before) {
  const auto to = [](double s) {
    SessionOrder order;
    order.kind = OrderKind::seek;
    order.sim_time_s = s;
    return order;
  };
  SessionOrder anew, pause;
  anew.kind = OrderKind::begin_anew;
  pause.kind = OrderKind::pause;
  EXPECT_TRUE(stands_for(to(5), to(30)));
  EXPECT_FALSE(stands_for(to(30), to(5))) << "at 5 s nobody knows what comes at 30";
  EXPECT_TRUE(stands_for(anew, to(5)));
  EXPECT_TRUE(stands_for(anew, anew));
  EXPECT_FALSE(stands_for(to(5), anew));
  EXPECT_FALSE(stands_for(pause, anew));
  EXPECT_FALSE(stands_for(anew, pause));
}

}  // namespace
}  // namespace sectio::net_test

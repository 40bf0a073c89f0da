#include "common/messages/link.h"

#include <gtest/gtest.h>

namespace sectio::dds_test {
namespace {

constexpr std::uint64_t kClient = 42;

// A program whose clock is `behind_s` behind the server's, and an exchange that takes so long there and back.
ServerStatus answer(double asked_s, double behind_s, double there_s, double waits_s) {
  LinkReport own;
  own.client = kClient;
  own.sent_s = asked_s;
  own.heard_s = asked_s + behind_s + there_s;
  ServerStatus status;
  status.link_reports = {LinkReport{}, own};
  status.sent_s = own.heard_s + waits_s;
  return status;
}

TEST(LinkClock, believes_the_exchange_that_took_the_least_time) {
  LinkClock clock;
  EXPECT_FALSE(clock.known());
  constexpr double kBehind_s = 1000, kWait_s = 0.4;
  for (const auto& [there_s, back_s] : {std::pair{0.3, 0.01}, {0.01, 0.012}, {0.02, 0.5}}) {
    const double asked_s = 7;
    const ServerStatus status = answer(asked_s, kBehind_s, there_s, kWait_s);
    clock.hear(asked_s + there_s + kWait_s + back_s, kClient, status);
  }
  ASSERT_TRUE(clock.known());
  EXPECT_NEAR(clock.round_trip_s(), 0.022, 1e-9);
  EXPECT_NEAR(clock.offset_s(), kBehind_s, 0.011 + 1e-9);
}

TEST(LinkClock, knows_nothing_from_the_status_of_a_server_that_has_not_heard_it) {
  LinkClock clock;
  clock.hear(1, kClient + 1, answer(0.9, 0, 0.01, 0.01));
  EXPECT_FALSE(clock.known());
  LinkReport report;
  clock.stamp(3, report);
  EXPECT_EQ(report.round_trip_s, 0);
  EXPECT_EQ(report.sent_s, 3);
}

TEST(LinkReport, has_a_line_of_its_own_for_hands_and_for_viewers) {
  LinkReport report;
  report.name = "scalpel";
  report.kind = ProgramKind::hand;
  report.rate_hz = 1000;
  report.came_per_s = 998.5;
  Ages ages;
  for (int ms = 1; ms <= 101; ++ms) ages.add(1e-3 * ms);
  ages.take(report);
  EXPECT_EQ(
      line_of(report),
      "hand   scalpel       sends 1000 poses/s, 998.5 contact models/s came, 0.0 % lost; a pose is answered after 51.0 "
      "ms, 99 % within 100.0 ms");
  report = {};
  report.name = "ward";
  report.rate_hz = 20;
  report.late_s = 0.012;
  EXPECT_EQ(line_of(report),
            "viewer ward          hears 20 states/s, 0.0 came, 0.0 % of their pieces lost, 12 ms late");
}

}  // namespace
}  // namespace sectio::dds_test

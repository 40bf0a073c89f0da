#include "sim_server/bodies/stillness.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <optional>

namespace sectio::bodies_test {
namespace {

constexpr double kStep_s = 0.001, kAfter_s = 1, kBound_m = 1e-4;

// The time within 5 s at which a body of two vertices, one of which moves as given, is found at rest.
std::optional<double> rests_at_s(const std::function<double(double time_s)>& x_m) {
  Stillness stillness;
  std::vector<Vec4f> positions(2, Vec4f::Zero());
  for (int n = 0; n <= 5000; ++n) {
    positions[1].x() = static_cast<float>(x_m(n * kStep_s));
    if (stillness.watch(positions, kStep_s, kAfter_s, kBound_m)) return n * kStep_s;
  }
  return {};
}

TEST(Stillness, what_does_not_move_rests_after_that_time) {
  EXPECT_NEAR(rests_at_s([](double) { return 0.3; }).value(), kAfter_s, 0.01);
}
TEST(Stillness, what_swings_within_the_bound_rests) {
  EXPECT_TRUE(rests_at_s([](double t) { return 0.3 * kBound_m * std::sin(50 * t); }).has_value());
}
TEST(Stillness, what_swings_further_does_not_rest) {
  for (const double per_s : {1.0, 5.0, 12.6, 50.0, 210.0})
    EXPECT_FALSE(rests_at_s([&](double t) { return 20 * kBound_m * std::sin(per_s * t); })) << per_s;
}
TEST(Stillness, what_drifts_does_not_rest_however_slowly_it_can_be_noticed) {
  EXPECT_FALSE(rests_at_s([](double t) { return 1.5 * kBound_m * t; }));
  EXPECT_FALSE(rests_at_s([](double t) { return 0.1 * kBound_m * t; }));
}
TEST(Stillness, what_decays_rests_when_less_than_the_bound_is_still_to_come) {
  for (const double tau_s : {0.1, 0.3}) {
    const auto x = [&](double t) { return 100 * kBound_m * std::exp(-t / tau_s); };
    const auto at_s = rests_at_s(x);
    ASSERT_TRUE(at_s.has_value());
    EXPECT_GT(*at_s, 2 * tau_s);
    EXPECT_LT(x(*at_s), kBound_m) << tau_s;
  }
}
TEST(Stillness, the_time_begins_anew_after_it_was_stirred) {
  Stillness stillness;
  const std::vector<Vec4f> positions(2, Vec4f::Zero());
  int steps = 0;
  for (int n = 0; n < 950; ++n) stillness.watch(positions, kStep_s, kAfter_s, kBound_m);
  stillness.begin_anew();
  while (!stillness.watch(positions, kStep_s, kAfter_s, kBound_m)) ++steps;
  EXPECT_GE(steps, 999);
}
TEST(Stillness, numbers_that_are_none_never_rest) {
  EXPECT_FALSE(rests_at_s([](double) { return std::numeric_limits<double>::quiet_NaN(); }));
}

}  // namespace
}  // namespace sectio::bodies_test

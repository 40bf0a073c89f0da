#include "device_bridge/servo/shake_gauge.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sectio {
namespace {

constexpr double kStep_s = 0.001, kResonance_rad_per_s = 145;

// A sine of the tip under a spring of 2000 N/m whose force lags by an angle, about a depth of 1 mm, to which it
// has come slowly.
double shaken_at_s(double hz, double amplitude_m, double lag_rad) {
  ShakeGauge gauge;
  const double rate = 2 * std::numbers::pi * hz;
  for (int i = 1; i <= 10'000; ++i) {
    const double t = i * kStep_s;
    const double way_m = amplitude_m * (std::sin(rate * t) - std::sin(rate * (t - kStep_s)));
    const double force_n =
        2000 * (0.001 * std::min(1.0, t) - amplitude_m * std::sin(rate * (t - kStep_s / 2) - lag_rad));
    if (gauge.is_shaken({kStep_s, Vec3(0, 0, way_m), Vec3(0, 0, force_n), true, kResonance_rad_per_s})) return t;
  }
  return INFINITY;
}

TEST(ShakeGauge, tells_when_a_hand_is_shaken_at_the_resonance) {
  EXPECT_LT(shaken_at_s(23, 3e-4, 0.1), 3);
  EXPECT_EQ(shaken_at_s(23, 3e-4, -0.1), INFINITY) << "the tissue takes energy";
  EXPECT_EQ(shaken_at_s(23, 1e-5, 0.1), INFINITY) << "nobody feels that";
}

TEST(ShakeGauge, leaves_a_slow_hand_behind_a_delay_alone) {
  EXPECT_EQ(shaken_at_s(3, 5e-4, 0.1), INFINITY);
}

// In for 20 ms and out for 30, and the force on the way out is higher by a tenth.
TEST(ShakeGauge, tells_when_a_hand_is_thrown_out_again_and_again) {
  const auto shaken = [](double out_over_in) {
    ShakeGauge gauge;
    for (int i = 0; i < 10'000; ++i) {
      const int at = i % 50;
      const bool touches = at < 20, out = at >= 10;
      const double depth_m = touches ? 5e-5 * (out ? 19.5 - at : at + 0.5) : 0;
      const Vec3 force_n(0, 0, 500 * depth_m * (out ? out_over_in : 1));
      if (gauge.is_shaken({kStep_s, Vec3(0, 0, touches ? (out ? 5e-5 : -5e-5) : 0), force_n, touches, 1e4}))
        return true;
    }
    return false;
  };
  EXPECT_TRUE(shaken(1.3));
  EXPECT_FALSE(shaken(0.9));
}

}  // namespace
}  // namespace sectio

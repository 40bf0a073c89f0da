// How true the force at a hand is, and how quiet, with the simulation itself at the other end of the wire.
#include <gtest/gtest.h>

#include "tests/feel/felt_motions.h"

namespace sectio::test {
namespace {

class FeltForce : public testing::TestWithParam<const char*> {
 protected:
  static Scene block(double young_pa) { return felt_block(GetParam(), young_pa); }
};
INSTANTIATE_TEST_SUITE_P(Models, FeltForce, testing::Values("surface_springs", "neo_hookean", "neo_hookean_lattice"),
                         [](const auto& model) { return std::string(model.param); });

TEST_P(FeltForce, is_true_to_sixty_hertz) {
  for (const Sine& sine : kSines) {
    const auto felt = felt_on_path(block(6e3), pressing(0.003, sine), kSinesFor_s, kWires);
    // The contact of surface springs resists motion in a way that the response doesn't have.
    const bool springs = GetParam() == std::string("surface_springs");
    const double to_ten_hz = springs ? 0.07 : 0.05, to_sixty_hz = springs ? 0.18 : 0.15;
    EXPECT_LT(error_of(felt[0], kSettled_s).varying, sine.hz <= 10 ? to_ten_hz : to_sixty_hz)
        << sine.hz << " Hz, no delay";
    EXPECT_LT(error_of(felt[1], kSettled_s).whole, 0.05) << sine.hz << " Hz, 25 ms";
  }
}

// The device's damping bounds how stiff a spring it can give, 2100 N/m with a hand. The stiffer tissue is near it.
TEST(FeltForceOfStiffTissue, is_true_to_sixty_hertz) {
  struct Tissue {
    double young_pa, depth_m, to_ten_hz, whole;
  };
  for (const Tissue& t : {Tissue{6e4, 0.003, 0.05, 0.05}, Tissue{3e5, 0.001, 0.1, 0.06}}) {
    for (const Sine& sine : {kSines[2], kSines[4]}) {  // 10 and 60 Hz
      const auto felt =
          felt_on_path(felt_block("neo_hookean_lattice", t.young_pa), pressing(t.depth_m, sine), kSinesFor_s, kWires);
      EXPECT_LT(error_of(felt[0], kSettled_s).varying, sine.hz <= 10 ? t.to_ten_hz : 0.15)
          << t.young_pa << " Pa, " << sine.hz << " Hz";
      EXPECT_LT(error_of(felt[1], kSettled_s).whole, t.whole) << t.young_pa << " Pa, " << sine.hz << " Hz, 25 ms";
    }
  }
}

// A slow hand receives some energy behind a delay. That is no reason to take its tissue for a third as stiff.
TEST(FeltForceOfStiffTissue, stays_stiff_under_a_slow_hand_behind_a_delay) {
  const auto felt =
      felt_on_path(felt_block("neo_hookean_lattice", 3e5), pressing(0.001, kSines[1]), 2.7, {{0.05, 0.02}});
  EXPECT_LT(error_of(felt[0], kSettled_s).whole, 0.05);
}

// It would be thrown out of the tissue again and again, if the bounds went on to count on its damping.
TEST(FeltForceOfStiffTissue, does_not_throw_a_weak_hand_about) {
  for (const WireSpec& wire : kWires) {
    const auto felt = felt_in_loop(felt_block("neo_hookean_lattice", 3e5), holding(0.001), 3, wire, kWeakHand);
    const FeltHold hold = hold_of(felt, 2);
    EXPECT_LT(hold.ripple_n, 0.05) << wire.delay_s << " s";
    EXPECT_LT(hold.power_w, 1e-4) << wire.delay_s << " s";
  }
}

// The front of a cut goes along with its body, and not with the soft tissue that swings beside the blade.
TEST_P(FeltForce, is_quiet_on_a_blade_that_is_held) {
  for (const WireSpec& wire : kWires) {
    const auto felt = felt_in_loop(blade_block(GetParam(), 1e3), cutting_and_holding(), 4, wire, kFirmHand);
    const FeltHold hold = hold_of(felt, 2.5);
    EXPECT_GT(felt.back().felt_n.norm(), 1) << "it does not hold the blade";
    EXPECT_LT(hold.ripple_n, 0.002) << wire.delay_s << " s";
    EXPECT_LT(hold.power_w, 1e-5) << wire.delay_s << " s";
  }
}

// The plane is known before the touch.
TEST_P(FeltForce, of_a_first_touch_is_not_late) {
  const auto felt = felt_on_path(block(6e3), tap(0.003, 0.05), 0.6, kWires);
  for (const auto& ticks : felt) EXPECT_LT(late_s(ticks, 0.002), 0.005);
}

TEST_P(FeltForce, is_quiet_in_a_hand_that_holds_still) {
  for (const double young_pa : {1e3, 6e3, 6e4, 3e5}) {
    for (const WireSpec& wire : kWires) {
      const auto felt = felt_in_loop(block(young_pa), holding(young_pa > 1e5 ? 0.001 : 0.003), 3, wire, kFirmHand);
      const FeltHold hold = hold_of(felt, 1.5);
      EXPECT_LT(hold.ripple_n, 0.05) << young_pa << " Pa, " << wire.delay_s << " s";
      EXPECT_LT(hold.power_w, 1e-3) << young_pa << " Pa, " << wire.delay_s << " s";
    }
  }
}

TEST(FeltForceControl, the_same_bits_again) {
  const auto once = [] {
    return felt_in_loop(felt_block("neo_hookean_lattice", 6e3), holding(0.003), 0.6, kWires[1], kFirmHand).back();
  };
  EXPECT_EQ(once().felt_n, once().felt_n);
}

}  // namespace
}  // namespace sectio::test

#include "sim_server/instruments/instrument.h"

#include <gtest/gtest.h>

namespace sectio::test {
namespace {

const InstrumentKind& instrument() {
  return instrument_of("scalpel");
}
const InstrumentShape kScalpel =
    instrument().shape({Vec3::Zero(), {0, 0, 0.03}, {0.006, 0, 0.012}, {0.006, 0, 0.02}}, {});
CutDecision decide(const Crossings& crossings, bool correct_direction) {
  return instrument().decide({crossings, correct_direction, Jaws::still});
}

Pose tip_at_depth(double depth_m) {
  return {Vec3(0, 0, -depth_m), Eigen::Quaterniond::Identity()};
}
Crossings at_depth(double depth_m) {
  return crossings_at(kScalpel, tip_at_depth(depth_m), Vec3::Zero(), Vec3::UnitZ());
}

// The decision tree of paper B, figure 4, leaf by leaf.
TEST(B_CD, B_CD_2_ab_and_ac_cross_and_the_direction_is_right_so_it_cuts) {
  EXPECT_EQ(decide({true, true, false}, true), CutDecision::cut);
  EXPECT_EQ(decide({true, true, true}, true), CutDecision::cut);
}
TEST(B_CD, B_CD_3_wrong_direction_pushes_back) {
  EXPECT_EQ(decide({true, true, false}, false), CutDecision::push_back);
  EXPECT_EQ(decide({true, true, true}, false), CutDecision::push_back);
}
TEST(B_CD, B_CD_4_ac_inside_as_a_whole_is_pushed_out) {
  EXPECT_EQ(decide({true, false, true}, true), CutDecision::push_out);
  EXPECT_EQ(decide({true, false, true}, false), CutDecision::push_out);
}
TEST(B_CD, B_CD_5_only_ab_crosses_so_the_shaft_deforms) {
  EXPECT_EQ(decide({true, false, false}, true), CutDecision::deform_with_shaft);
  EXPECT_EQ(decide({true, false, false}, false), CutDecision::deform_with_shaft);
}
TEST(B_CD, B_CD_6_ab_does_not_cross_so_look_again) {
  for (const bool ac : {false, true})
    for (const bool bd : {false, true})
      for (const bool direction : {false, true})
        EXPECT_EQ(decide({false, ac, bd}, direction), CutDecision::detect_again);
}

TEST(B_CD, B_CD_1_segments_cross_as_the_instrument_sinks) {
  const auto expect = [](double depth_m, bool ab, bool ac, bool bd) {
    const Crossings c = at_depth(depth_m);
    EXPECT_EQ(std::tuple(c.ab, c.ac, c.bd), std::tuple(ab, ac, bd)) << depth_m;
  };
  expect(-0.001, false, false, false);  // above
  expect(0.004, true, true, false);     // the edge is in the surface
  expect(0.015, true, false, false);    // the edge is inside, the blunt front in the surface
  expect(0.025, true, false, true);     // the blunt front is inside, too
  expect(0.035, false, false, false);   // the whole instrument is inside
}

TEST(B_CD, B_CD_9_only_one_edge_is_sharp) {
  const Pose upright = tip_at_depth(0.004);
  for (int degrees = -180; degrees <= 180; degrees += 5) {
    const double a = degrees * M_PI / 180;
    const bool correct = correct_direction(kScalpel, upright, 1e-4 * Vec3(std::cos(a), std::sin(a), 0), Vec3::UnitZ());
    EXPECT_TRUE(std::abs(degrees) == 60 || correct == (std::abs(degrees) < 60)) << degrees;
  }
  EXPECT_TRUE(correct_direction(kScalpel, upright, 1e-9 * -Vec3::UnitX(), Vec3::UnitZ())) << "too short to have one";
  EXPECT_TRUE(correct_direction(kScalpel, upright, Vec3(1e-4, 0, -1), Vec3::UnitZ())) << "seen in the surface";
}

TEST(B_CD, B_CD_9_the_sharp_side_turns_with_the_tool) {
  Pose turned = tip_at_depth(0.004);
  turned.orientation = Eigen::AngleAxisd(M_PI / 2, Vec3::UnitZ());
  EXPECT_LT((turned.orientation * *kScalpel.sharp_side_tool - Vec3::UnitY()).norm(), 1e-12);
  EXPECT_TRUE(correct_direction(kScalpel, turned, 1e-4 * Vec3::UnitY(), Vec3::UnitZ()));
  EXPECT_FALSE(correct_direction(kScalpel, turned, 1e-4 * Vec3::UnitX(), Vec3::UnitZ()));
}

TEST(B_CD, B_CD_8_force_is_the_default_threshold_displacement_the_alternative) {
  const RuptureThreshold force{0.5, std::nullopt, 0.7}, displacement{0.5, 0.002, 0.7};
  EXPECT_FALSE(ruptures(force, 0.499, 1, false));
  EXPECT_TRUE(ruptures(force, 0.5, 0, false));
  EXPECT_FALSE(ruptures(displacement, 100, 0.0019, false)) << "where a displacement is given, force has no say";
  EXPECT_TRUE(ruptures(displacement, 0, 0.002, false));
  EXPECT_FALSE(ruptures({std::nullopt, std::nullopt, 0.7}, 100, 1, false));
}

TEST(B_CD, B_CD_8_hysteresis) {
  const RuptureThreshold force{0.5, std::nullopt, 0.7}, displacement{std::nullopt, 0.002, 0.7};
  EXPECT_FALSE(ruptures(force, 0.36, 0, false));
  EXPECT_TRUE(ruptures(force, 0.36, 0, true));
  EXPECT_FALSE(ruptures(force, 0.34, 0, true));
  EXPECT_TRUE(ruptures(displacement, 0, 0.0015, true));
  EXPECT_FALSE(ruptures(displacement, 0, 0.0013, true));
}

TEST(B_CD, B_CD_10_the_virtual_tip_of_a_cautery_cuts_in_any_direction) {
  const InstrumentKind& cautery = instrument_of("cautery_hook");
  const InstrumentShape hook = cautery.shape(cautery.geometry, {});
  const EdgeInWorld blade = edge_at(hook, {Vec3(0, 0, 0.001), Eigen::Quaterniond::Identity()});
  EXPECT_LT((blade.tip_world_m - Vec3(0, 0, -0.004)).norm(), 1e-12) << "D";
  EXPECT_LT((blade.up_world - Vec3::UnitZ()).norm(), 1e-12);
  for (const Vec3& d : {Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(0, 1, 0), Vec3(0, -1, 0)})
    EXPECT_TRUE(correct_direction(hook, {}, 1e-3 * d, Vec3::UnitZ()));
}

TEST(B_CD, B_CD_1_the_blade_of_a_scalpel_is_ac) {
  const EdgeInWorld blade = edge_at(kScalpel, tip_at_depth(0.004));
  EXPECT_LT((blade.tip_world_m - Vec3(0, 0, -0.004)).norm(), 1e-12);
  EXPECT_LT((blade.up_world - Vec3(0.006, 0, 0.012).normalized()).norm(), 1e-12);
}

}  // namespace
}  // namespace sectio::test

// The shape and the decision rule of each kind of instrument, without tissue.
#include <gtest/gtest.h>

#include <cmath>

#include "common/core/error.h"
#include "sim_server/instruments/instrument.h"

namespace sectio::test {
namespace {

InstrumentShape usual(const char* kind, double opening_rad = 0, std::size_t edge = 0) {
  const InstrumentKind& instrument = instrument_of(kind);
  return instrument.shape(instrument.geometry, {1, opening_rad, edge});
}
Vec3 crossing_of(const InstrumentShape& s) {
  const ToolGeometry& g = instrument_of("scissors").geometry;
  return s.edge_tip_tool_m - (g.d_tool_m - g.a_tool_m);
}

TEST(Instruments, every_kind_is_whole) {
  EXPECT_EQ(instrument_kinds().size(), 7u);
  for (const std::string& kind : instrument_kinds())
    EXPECT_EQ(instrument_of(kind).flaw(instrument_of(kind).geometry), "");
  EXPECT_THROW(instrument_of("spoon"), InputError);
}

TEST(A_TOOL, A_TOOL_1_a_knife_is_sharp_up_to_a_point_of_ac) {
  const InstrumentKind& knife = instrument_of("knife");
  const InstrumentShape s = usual("knife");
  EXPECT_NEAR((s.edge_heel_tool_m - s.a_tool_m).norm(), knife.geometry.sharp_length_m, 1e-12);
  EXPECT_EQ(knife.decide({{true, true, false, true}, true, Jaws::still}), CutDecision::cut);
  EXPECT_EQ(knife.decide({{true, true, false, true}, false, Jaws::still}), CutDecision::push_back);
  EXPECT_EQ(knife.decide({{true, true, false, false}, true, Jaws::still}), CutDecision::deform_with_shaft) << "blunt";
  ToolGeometry longer = knife.geometry;
  longer.sharp_length_m = 0.1;
  EXPECT_NE(knife.flaw(longer), "");
}

TEST(A_TOOL, A_TOOL_1_a_probe_has_no_edge) {
  const InstrumentKind& probe = instrument_of("probe");
  EXPECT_FALSE(probe.tip_pierces || probe.edge_enters);
  for (const bool direction : {false, true})
    for (int bits = 0; bits < 16; ++bits)
      EXPECT_NE(probe.decide(
                    {{(bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0, (bits & 8) != 0}, direction, Jaws::closing}),
                CutDecision::cut);
}

TEST(Instruments, forceps_hold_and_never_cut) {
  const InstrumentKind& forceps = instrument_of("forceps");
  EXPECT_GT(forceps.grip_below_rad, 0);
  EXPECT_GT(forceps.grip_force_n, 0);
  EXPECT_FALSE(forceps.tip_pierces || forceps.may_enter(Jaws::closing));
  EXPECT_NE(forceps.decide({{true, true, true, true}, true, Jaws::closing}), CutDecision::cut);
  const InstrumentShape s = usual("forceps", 0.4);
  EXPECT_NEAR((s.a_tool_m - s.d_tool_m).norm(), 2 * 0.05 * std::sin(0.2), 1e-9) << "the tips are apart";
  EXPECT_EQ(s.edge_tip_tool_m, s.edge_heel_tool_m);
}

TEST(A_TOOL, A_TOOL_2_the_crossing_runs_from_the_pivot_to_the_tips) {
  const ToolGeometry& g = instrument_of("scissors").geometry;
  double before_m = 0;
  for (double opening_rad = 1.5; opening_rad >= 0.11; opening_rad -= 0.1) {
    const InstrumentShape s = usual("scissors", opening_rad);
    const double from_pivot_m = (crossing_of(s) - g.c_tool_m).norm();
    EXPECT_GT(from_pivot_m, before_m);
    before_m = from_pivot_m;
    EXPECT_NEAR((s.a_tool_m - g.c_tool_m).dot(s.d_tool_m - g.c_tool_m) / (g.c_tool_m - g.a_tool_m).squaredNorm(),
                std::cos(opening_rad), 1e-9);
  }
  EXPECT_LT((crossing_of(usual("scissors", 0)) - g.a_tool_m).norm(), 1e-9) << "closed";
}

TEST(A_TOOL, A_TOOL_2_the_rule_of_scissors) {
  const InstrumentKind& scissors = instrument_of("scissors");
  const Crossings in{true, true, true, true}, out{true, true, true, false};
  EXPECT_EQ(scissors.decide({in, true, Jaws::closing}), CutDecision::cut);
  EXPECT_EQ(scissors.decide({in, false, Jaws::closing}), CutDecision::push_back);
  EXPECT_EQ(scissors.decide({in, true, Jaws::still}), CutDecision::push_back);
  EXPECT_EQ(scissors.decide({in, true, Jaws::opening}), CutDecision::detect_again);
  EXPECT_EQ(scissors.decide({out, true, Jaws::closing}), CutDecision::push_back) << "it comes back in a moment";
  EXPECT_EQ(scissors.decide({out, true, Jaws::still}), CutDecision::detect_again);
  EXPECT_TRUE(scissors.may_enter(Jaws::closing));
  EXPECT_FALSE(scissors.may_enter(Jaws::still) || scissors.may_enter(Jaws::opening));
}

TEST(A_TOOL, A_TOOL_3_the_edges_of_a_u_are_apart_by_its_gauge) {
  const double gauge_m = instrument_of("medical_scissors").geometry.gauge_m;
  EXPECT_EQ(instrument_of("medical_scissors").edges, 2u);
  for (const double opening_rad : {0.0, 0.3, 0.8}) {
    const InstrumentShape one = usual("medical_scissors", opening_rad, 0);
    const InstrumentShape other = usual("medical_scissors", opening_rad, 1);
    EXPECT_NEAR((one.edge_tip_tool_m - other.edge_tip_tool_m).norm(), gauge_m, 1e-12);
    const Vec3 middle = 0.5 * (crossing_of(one) + crossing_of(other));
    EXPECT_LT((middle - crossing_of(usual("scissors", opening_rad))).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace sectio::test

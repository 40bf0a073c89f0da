// A blade costs the hand that moves it the toughness of the tissue times the area that is new, and nothing where the
// tissue is cut already.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <span>
#include <vector>

#include "sim_server/engine/standard_traits.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/session/trace_player.h"
#include "sim_server/simulation.h"
#include "tests/feel/blade_work.h"
#include "tests/feel/felt_motions.h"
#include "tests/support/operation.h"

namespace sectio::test {
namespace {

class BladeWork : public testing::TestWithParam<BladeTissue> {
 protected:
  // Cutting costs the toughness, going back and forth nothing, and the simulation counts the same work as the hand.
  static void check(const BladeStroke& stroke, double speed_m_per_s) {
    double due_j = 0, cut_j = 0, done_j = 0, booked_j = 0;
    const std::vector<LegWork> legs = work_of(GetParam(), stroke, speed_m_per_s);
    for (const LegWork& leg : legs) {
      due_j += kToughness_j_per_m2 * leg.leg.new_area_m2;
      if (leg.leg.new_area_m2 > 0) cut_j += leg.work_j;
      done_j += leg.work_j;
      booked_j += leg.booked_j;
      if (leg.leg.is_steady) {
        EXPECT_LT(leg.ripple_n, 0.1 * leg.mean_n) << leg.leg.name;
      }
    }
    const auto where = stroke.name + " at " + std::to_string(speed_m_per_s) + " m/s";
    EXPECT_GT(cut_j, 0.8 * due_j) << where;
    EXPECT_LT(cut_j, 1.2 * due_j) << where;
    EXPECT_NEAR(booked_j, done_j, 0.1 * due_j) << where;
    for (const LegWork& leg : legs) {
      if (leg.leg.new_area_m2 > 0) continue;
      EXPECT_NEAR(leg.work_j, 0, 0.2 * due_j) << where << ", " << leg.leg.name;
    }
  }
};
INSTANTIATE_TEST_SUITE_P(Tissues, BladeWork,
                         testing::Values(BladeTissue{"springs", "surface_springs"},
                                         BladeTissue{"fine_springs", "surface_springs", "progressive", 4},
                                         BladeTissue{"templates", "surface_springs", "templates"},
                                         BladeTissue{"tetra_springs", "tetra_springs", "progressive", 2, 2000},
                                         BladeTissue{"neo_hookean", "neo_hookean", "progressive", 2, 2000},
                                         BladeTissue{"lattice", "neo_hookean_lattice", "progressive", 2, 2000, 0.005}),
                         [](const auto& tissue) { return tissue.param.name; });

TEST_P(BladeWork, is_toughness_times_new_area) {
  check(slide_and_return(0.006, 0.016), 0.05);
  check(slide_and_return(0.006, 0.016), 0.5);
  check(plunge(0.012), 0.1);
}

// Each of three rings is two arcs, the second of which goes on in the groove of the first, with the blade turned about.
// Its edge met what the first had cut, and lost up to 60 % of its force every two millimetres.
TEST(BladeAround, is_held_as_strongly_in_the_second_arc_as_in_the_first) {
  constexpr double kRises_s = 0.4, kFalls_s = 0.15;
  Scene scene = prepared(load_scene(SECTIO_SOURCE_DIR "/deploy/scenes/skin_rings.yaml", standard_traits()));
  Simulation simulation(scene);
  std::vector<double> force_n;
  int arcs = 0;
  StepInput input;
  for (std::uint64_t k = 1; static_cast<double>(k) * scene.step_s <= scene.duration_s; ++k) {
    input.samples = samples_of_traces(scene, k);
    const StepOutput& out = simulation.step(input);
    if (!out.contacts.empty()) force_n.push_back(out.contacts[0].force_world_n.norm());
    for (const Event& e : out.events) {
      if (e.kind == EventKind::penetrated) force_n.clear();
      if (e.kind != EventKind::cut_ended && e.kind != EventKind::joined) continue;
      const auto rises = static_cast<std::size_t>(kRises_s / scene.step_s),
                 falls = static_cast<std::size_t>(kFalls_s / scene.step_s);
      if (force_n.size() < rises + 2 * falls) continue;
      const std::span<const double> steady(force_n.begin() + rises, force_n.end() - falls);
      double sum = 0, squares = 0;
      for (const double f : steady) sum += f, squares += f * f;
      const double n = static_cast<double>(steady.size()), mean_n = sum / n;
      const double ripple = std::sqrt(std::max(0.0, squares / n - mean_n * mean_n)) / mean_n;
      std::printf("an arc that ends at %.2f s: %.2f N, ripple %.1f %%\n", static_cast<double>(e.step) * scene.step_s,
                  mean_n, 100 * ripple);
      EXPECT_LT(ripple, 0.05);
      force_n.clear();
      ++arcs;
    }
  }
  EXPECT_GE(arcs, 6);
}

// The frame of the tissue about the blade is told by a vertex, now of the freed piece, now of its ground: from step to
// step the blade was pushed to and fro by 0.7 N.
TEST(BladeAround, is_not_shaken_beside_the_piece_that_it_has_freed) {
  Scene scene = prepared(load_scene(SECTIO_SOURCE_DIR "/deploy/scenes/skin_arcs.yaml", standard_traits()));
  Simulation simulation(scene);
  StepInput input;
  bool is_beside = false, was_beside = false;
  Vec3 before_n = Vec3::Zero();
  double largest_n = 0;
  for (std::uint64_t k = 1; static_cast<double>(k) * scene.step_s <= scene.duration_s; ++k) {
    input.samples = samples_of_traces(scene, k);
    const StepOutput& out = simulation.step(input);
    for (const Event& e : out.events) {
      is_beside |= e.kind == EventKind::island_freed;
      was_beside |= is_beside;
      is_beside &= e.kind != EventKind::cut_ended;
    }
    const Vec3 now_n = out.contacts.empty() ? Vec3(Vec3::Zero()) : out.contacts[0].force_world_n;
    if (is_beside) largest_n = std::max(largest_n, (now_n - before_n).norm());
    before_n = now_n;
  }
  EXPECT_TRUE(was_beside);
  EXPECT_LT(largest_n, 0.35);
}

class BladeWorkThrough : public testing::TestWithParam<std::pair<BladeTissue, double>> {};
INSTANTIATE_TEST_SUITE_P(
    Tissues, BladeWorkThrough,
    testing::Values(std::pair{BladeTissue{"neo_hookean", "neo_hookean", "progressive", 2, 2000}, 0.2},
                    std::pair{BladeTissue{"lattice", "neo_hookean_lattice", "progressive", 2, 2000, 0.005}, 0.04}),
    [](const auto& tissue) { return tissue.param.first.name; });

TEST_P(BladeWorkThrough, of_a_knife_from_side_to_side) {
  const auto& [tissue, speed_m_per_s] = GetParam();
  const std::vector<LegWork> legs = work_of(tissue, right_through(), speed_m_per_s);
  const double due_j = kToughness_j_per_m2 * legs[0].leg.new_area_m2;
  EXPECT_GT(legs[0].work_j, 0.8 * due_j);
  EXPECT_LT(legs[0].work_j, 1.2 * due_j);
  EXPECT_LT(legs[0].ripple_n, 0.1 * legs[0].mean_n);
}

// The end of a slit holds the edge, however the lips have closed about the blade.
TEST_P(BladeWorkThrough, of_a_knife_that_is_put_back_into_its_slit) {
  const auto& [tissue, speed_m_per_s] = GetParam();
  for (const LegWork& leg : work_of(tissue, put_back(), speed_m_per_s)) {
    const double half_j = 0.03 * kBlockTop_m * kToughness_j_per_m2;
    EXPECT_NEAR(leg.work_j, kToughness_j_per_m2 * leg.leg.new_area_m2, 0.2 * half_j) << leg.leg.name;
  }
}

// Atkins, Xu and Jeronimidis (2004): with xi the slice over the push, J L / (1 + xi^2) across and xi times that along
// the edge; and steady cutting without a slice at J L.
TEST(BladeSlices, with_the_less_push_the_more_it_is_drawn) {
  constexpr double kSoft_j_per_m2 = 40;
  const Vec3 edge = edge_of_knife(), ahead = Vec3::UnitY().cross(edge);
  const double due_n = kSoft_j_per_m2 * kBlockTop_m / edge.z();
  for (const double xi : {0.0, 1.0, 2.0}) {
    const auto legs = work_of({"", "neo_hookean", "progressive", 2, 2000, 0, kSoft_j_per_m2}, slice(xi), 0.05);
    const double push_n = -legs.back().last_n.dot(ahead), slice_n = legs.back().last_n.dot(edge);
    EXPECT_NEAR(push_n * (1 + xi * xi) / due_n, 1, xi > 0 ? 0.1 : 0.05) << xi;
    EXPECT_NEAR(slice_n * (1 + xi * xi) / due_n, xi, 0.1 * std::max(1.0, xi)) << xi;
  }
}

// The skin holds a point up to its threshold, breaks, and lets the force drop; then the front holds the edge by as much
// as is in the tissue.
TEST(BladeBreaksIn, with_a_drop_of_its_force) {
  constexpr double kThreshold_n = 0.5;
  Scene scene = blade_block("neo_hookean", 6e4);
  scene.bodies[0].cutting.threshold_force_n = kThreshold_n;
  Operation op(scene);
  op.place(Vec3(0.001, 0.0017, kBlockTop_m + 0.001));
  double before_n = 0, least_n = HUGE_VAL;
  int since = 0;
  op.after_each = [&](const StepOutput&) {
    const bool is_in = op.count(EventKind::penetrated) > 0;
    if (!is_in) before_n = std::max(before_n, op.force_n().z());
    if (is_in && since++ < 20) least_n = std::min(least_n, op.force_n().norm());
  };
  op.move(Vec3(0.001, 0.0017, kBlockTop_m - 0.008), 0.01);
  ASSERT_EQ(op.count(EventKind::penetrated), 1u);
  EXPECT_NEAR(before_n, kThreshold_n, 0.1 * kThreshold_n);
  EXPECT_LT(least_n, 0.5 * kThreshold_n) << "the pop";
  EXPECT_GT(op.force_n().norm(), 2 * least_n);
}

TEST(BladeHeld, is_quiet_behind_any_wire) {
  for (const double young_pa : {1e3, 6e4}) {
    for (const WireSpec& wire : kWires) {
      const auto felt =
          felt_in_loop(blade_block("surface_springs", young_pa), cutting_and_holding(), 3, wire, kFirmHand);
      const FeltHold hold = hold_of(felt, 2);
      EXPECT_LT(hold.ripple_n, 0.05) << young_pa << " Pa, " << wire.delay_s << " s";
      EXPECT_LT(hold.power_w, 1e-3) << young_pa << " Pa, " << wire.delay_s << " s";
      EXPECT_GT(felt.back().felt_n.norm(), 1) << "the front holds the blade";
    }
  }
}

}  // namespace
}  // namespace sectio::test

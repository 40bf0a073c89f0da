// A hand whose jaws hold tissue or a loose piece: it is quiet, whatever the wire, and feels what pulls at it.
#include <gtest/gtest.h>

#include "sim_server/engine/standard_traits.h"
#include "tests/feel/felt_motions.h"

namespace sectio::test {
namespace {

std::vector<FeltTick> before(const std::vector<FeltTick>& ticks, double end_s) {
  std::vector<FeltTick> some;
  std::ranges::copy_if(ticks, std::back_inserter(some), [&](const FeltTick& tick) { return tick.time_s < end_s; });
  return some;
}

class FeltGrip : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Models, FeltGrip, testing::Values("surface_springs", "neo_hookean", "neo_hookean_lattice"),
                         [](const auto& model) { return std::string(model.param); });

TEST_P(FeltGrip, of_tissue_is_quiet) {
  const std::vector<std::pair<WireSpec, HandSpec>> ends{
      {kGripWires[0], kFirmHand}, {kGripWires[1], kFirmHand}, {kGripWires[3], kWeakHand}};
  for (const double young_pa : {1e3, 3e5})
    for (const auto& [wire, hand] : ends) {
      const auto felt = felt_in_scene(gripped_block(GetParam(), young_pa), 0, kLifts_s, wire, hand);
      const FeltHold hold = hold_of(felt, kGripped_s);
      EXPECT_LT(hold.ripple_n, 0.05) << young_pa << " Pa, " << wire.delay_s << " s";
      EXPECT_LT(hold.power_w, 2e-4) << young_pa << " Pa, " << wire.delay_s << " s";
    }
}

TEST_P(FeltGrip, of_tissue_that_is_lifted_pulls_as_the_tissue_does) {
  for (const WireSpec& wire : {kGripWires[0], kGripWires[2]}) {
    const auto felt = felt_in_scene(gripped_block(GetParam(), 6e3), 0, kGripFor_s, wire, kFirmHand);
    const FeltTick& last = felt.back();
    EXPECT_LT(last.truth_n.z(), -0.05) << "the tissue slipped";
    EXPECT_LT((last.felt_n - last.truth_n).norm(), 0.05 * last.truth_n.norm()) << wire.delay_s << " s";
  }
}

// A late session spares the bed: the piece is stuck in a wall.
TEST(FeltGripOfAPiece, is_quiet_in_its_bed_and_does_not_lose_it) {
  const Scene exercise = load_scene(SECTIO_SOURCE_DIR "/deploy/scenes/exercise_tumour.yaml", standard_traits());
  const Lift lift = lifting(exercise, 1, 0.1), jerk = lifting(exercise, 1, 1.2);
  const double weight_n = 0.02;
  const auto try_out = [&](const Lift& way, const WireSpec& wire, const HandSpec& hand, bool is_late) {
    SCOPED_TRACE(std::to_string(wire.delay_s) + " s" + (is_late ? ", late" : ""));
    const auto felt = felt_in_scene(way.scene, 1, way.ends_s, wire, hand, is_late);
    const FeltHold hold = hold_of(before(felt, way.closed_s + kHoldFor_s), way.closed_s + 0.5);
    EXPECT_LT(hold.ripple_n, 0.05);
    EXPECT_LT(hold.power_w, 1e-4);
    EXPECT_LT(felt.back().truth_n.z(), -weight_n) << "the piece is lost";
  };
  try_out(lift, kGripWires[1], kFirmHand, false);
  try_out(lift, kGripWires[3], kWeakHand, false);
  try_out(lift, kGripWires[1], kFirmHand, true);
  try_out(jerk, kGripWires[2], kFirmHand, true);
}

}  // namespace
}  // namespace sectio::test

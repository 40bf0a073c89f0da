// The exercise that the surgeon of paper C asked for, as it is delivered.
#include <gtest/gtest.h>

#include "sim_server/engine/standard_traits.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/session/exercise_score.h"
#include "sim_server/session/trace_player.h"
#include "sim_server/simulation.h"

namespace sectio {
namespace {

// And the same operation with the tray elsewhere.
TEST(C_EXP, C_EXP_1_a_tumour_cut_out_of_a_kidney_is_in_the_tray_or_misses_it) {
  const Scene scene = load_scene(SECTIO_SOURCE_DIR "/deploy/scenes/tumour_kidney.yaml", standard_traits());
  Scene other = scene;
  other.exercise->bin->min_world_m.x() += 0.1;
  other.exercise->bin->max_world_m.x() += 0.1;
  Simulation simulation(prepared(scene));
  ExerciseScore hit(scene, simulation), miss(other, simulation);
  StepInput input;
  for (std::uint64_t k = 1; k <= steps_of(scene, 0); ++k) {
    input.samples = samples_of_traces(scene, k);
    const StepOutput& output = simulation.step(input);
    hit.add(output);
    miss.add(output);
  }
  const Score in = hit.finish(), out = miss.finish();
  EXPECT_GT(in.marked_removed_m3, 0.9 * in.marked_m3);
  EXPECT_LT(in.marked_removed_m3, in.marked_m3) << "some is left in its bed";
  EXPECT_TRUE(in.in_bin);
  EXPECT_GT(in.instruments[2].contact_time_s, 5) << "a third arm holds the organ";
  EXPECT_FALSE(out.in_bin);
  EXPECT_EQ(out.marked_removed_m3, in.marked_removed_m3);
  double removed_m3 = 0;  // and what the score says is the volume of the part
  for (std::uint32_t b = static_cast<std::uint32_t>(scene.bodies.size()); b < simulation.body_count(); ++b)
    removed_m3 += simulation.region_volumes(b).total_m3();
  EXPECT_NEAR(in.marked_removed_m3 + in.healthy_lost_m3, removed_m3, 1e-3 * removed_m3);
}

// The same on a volume: a pole of tetrahedra, marked tissue and all, is cut off and becomes a rigid piece.
TEST(C_EXP, C_EXP_1_the_pole_of_a_volume_is_cut_off_and_put_into_the_tray) {
  const Scene scene = load_scene(SECTIO_SOURCE_DIR "/deploy/scenes/tumour_pole.yaml", standard_traits());
  Simulation simulation(prepared(scene));
  ExerciseScore score(scene, simulation);
  StepInput input;
  for (std::uint64_t k = 1; k <= steps_of(scene, 0); ++k) {
    input.samples = samples_of_traces(scene, k);
    score.add(simulation.step(input));
    if (k != steps_of(scene, 0) * 3 / 4) continue;  // it is about to be let go
    Eigen::AlignedBox3d pole;
    for (const Vec3f& x : simulation.positions_world_m(2)) pole.extend(x.cast<double>());
    for (const int axis : {0, 1}) {
      EXPECT_GT(pole.min()[axis], scene.exercise->bin->min_world_m[axis] + 0.006) << "its wall would catch on the rim";
      EXPECT_LT(pole.max()[axis], scene.exercise->bin->max_world_m[axis] - 0.006);
    }
  }
  const Score result = score.finish();
  EXPECT_NEAR(result.marked_removed_m3, result.marked_m3, 0.01 * result.marked_m3);
  EXPECT_TRUE(result.in_bin);
  EXPECT_GT(result.healthy_lost_m3, result.marked_m3) << "the cut was generous";
  ASSERT_EQ(result.removed.size(), 1u);
  EXPECT_EQ(result.removed[0].body, "kidney.1");
}

}  // namespace
}  // namespace sectio

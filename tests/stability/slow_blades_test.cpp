// Tissue around a slow blade is calm. A hand that cuts slowly makes the end of its cut anew hundreds of times in each
// element, and none of these changes may drive the tissue. Prints a table (docs/robustness.md).
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "sim_server/engine/standard_traits.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/session/trace_player.h"
#include "sim_server/simulation.h"
#include "sim_server/trials/hand.h"

namespace sectio {
namespace {

constexpr double kFast_m_per_s = 0.5;  // blades below go at a few mm/s
constexpr double kUntil_s = 20;

class SlowBlades : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Scenes, SlowBlades,
                         testing::Values("skin_cross", "skin_zigzag", "kidney_loop", "incision_templates"),
                         [](const auto& scene) { return scene.param; });

// The largest speed of a vertex that was there before the step, and is there still.
double largest_speed_m_per_s(const Simulation& simulation, std::vector<Vec3f>& before_world_m, double step_s) {
  const auto now_world_m = simulation.positions_world_m(0);
  double farthest_m = 0;
  for (VertexId v = 0; v < std::min(before_world_m.size(), now_world_m.size()); ++v)
    if (simulation.mesh(0).vertex_alive(v))
      farthest_m = std::max(farthest_m, double{(now_world_m[v] - before_world_m[v]).norm()});
  before_world_m.assign(now_world_m.begin(), now_world_m.end());
  return farthest_m / step_s;
}

TEST_P(SlowBlades, leave_the_tissue_around_them_calm) {
  Hand hand;
  hand.slower = 4;
  const std::string file = std::string(SECTIO_SOURCE_DIR "/deploy/scenes/") + GetParam() + ".yaml";
  const Scene scene = prepared(in_hand(load_scene(file, standard_traits()), hand, 1));
  Simulation simulation(scene);
  std::vector<Vec3f> before_world_m;
  StepInput input;
  int steps_that_cut = 0, fast = 0;
  for (std::uint64_t k = 1; static_cast<double>(k) * scene.step_s <= std::min(scene.duration_s, kUntil_s); ++k) {
    input.samples = samples_of_traces(scene, k);
    const StepOutput& out = simulation.step(input);
    const double speed_m_per_s = largest_speed_m_per_s(simulation, before_world_m, scene.step_s);
    if (std::ranges::none_of(out.contacts, [](const auto& c) { return c.state == ContactState::penetration; }))
      continue;
    ++steps_that_cut;
    fast += speed_m_per_s > kFast_m_per_s;
  }
  std::printf("| %s | %.1f %% of %d |\n", GetParam(), 100.0 * fast / steps_that_cut, steps_that_cut);
  EXPECT_GT(steps_that_cut, 5000);
  EXPECT_LT(fast, 0.03 * steps_that_cut);
}

}  // namespace
}  // namespace sectio

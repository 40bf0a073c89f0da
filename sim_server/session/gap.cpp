#include "sim_server/session/gap.h"

#include <algorithm>
#include <cinttypes>

#include "common/core/formatted.h"
#include "sim_server/session/trace_player.h"
#include "sim_server/simulation.h"

namespace sectio {

std::string measure_gaps(const Scene& scene) {
  Simulation simulation(scene);
  std::vector<std::vector<ContactGap>> gaps(scene.bodies.size());
  StepInput input;
  for (std::uint64_t k = 1; k <= steps_of(scene, 0); ++k) {
    input.samples = samples_of_traces(scene, k);
    simulation.step(input);
    for (std::uint32_t b = 0; b < gaps.size(); ++b) gaps[b].push_back(simulation.contact_gap(b));
  }
  std::string text;
  for (std::size_t b = 0; b < gaps.size(); ++b) {
    double deepest_m = 0, most_m = 0, sum_m = 0;
    for (const ContactGap& g : gaps[b]) deepest_m = std::max(deepest_m, g.depth_m);
    std::uint64_t steps = 0;
    for (const ContactGap& g : gaps[b]) {
      if (g.depth_m < 0.9 * deepest_m || g.depth_m <= 0) continue;  // still on its way in, or out already
      most_m = std::max(most_m, g.gap_m);
      sum_m += g.gap_m;
      ++steps;
    }
    text += formatted("%s, contact by %s, pressed to %.1f mm: gap at most %.2f mm, in the mean %.2f mm (%" PRIu64
                      " steps)\n",
                      scene.bodies[b].name.c_str(), scene.bodies[b].contact.style.c_str(), 1e3 * deepest_m,
                      1e3 * most_m, steps > 0 ? 1e3 * sum_m / static_cast<double>(steps) : 0, steps);
  }
  return text;
}

}  // namespace sectio

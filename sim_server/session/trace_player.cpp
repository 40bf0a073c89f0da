#include "sim_server/session/trace_player.h"

#include <cmath>

namespace sectio {

std::uint64_t steps_of(const Scene& scene, std::uint64_t steps) {
  return steps > 0 ? steps : static_cast<std::uint64_t>(std::llround(scene.duration_s / scene.step_s));
}

std::vector<ToolSample> samples_of_traces(const Scene& scene, std::uint64_t step) {
  constexpr double kSamplePeriod_s = 0.001;
  const auto index_at = [](double time_s) {
    return static_cast<std::uint64_t>(std::floor(time_s / kSamplePeriod_s + 1e-9));
  };
  const std::uint64_t first = step == 1 ? 0 : index_at(static_cast<double>(step - 1) * scene.step_s) + 1;
  const std::uint64_t last = index_at(static_cast<double>(step) * scene.step_s);
  std::vector<ToolSample> samples;
  for (std::uint32_t tool = 0; tool < scene.tools.size(); ++tool) {
    if (scene.tools[tool].trace.empty()) continue;
    for (std::uint64_t i = first; i <= last; ++i) {
      const double time_s = static_cast<double>(i) * kSamplePeriod_s;
      const TracePoint point = point_at(scene.tools[tool].trace, time_s);
      samples.push_back({tool, i + 1, time_s, point.pose_world, point.opening_rad});
    }
  }
  return samples;
}

}  // namespace sectio

#include "sim_server/session/offline_run.h"

#include <algorithm>
#include <chrono>

#include "common/core/processor_time.h"
#include "sim_server/prepare/fill_volumes.h"
#include "sim_server/scene/scene_warnings.h"
#include "sim_server/session/progress.h"
#include "sim_server/session/recorder.h"
#include "sim_server/session/trace_player.h"

namespace sectio {

RunResult run_offline(const Scene& scene, std::uint64_t steps, const std::string& directory) {
  using Clock = std::chrono::steady_clock;
  const Scene filled = fill_volumes(scene);
  Simulation simulation(filled);
  simulation.measure_with(processor_time_s);
  Recorder recorder(filled, simulation, directory);
  const std::uint64_t last = steps_of(scene, steps);
  const double duration_s = std::max(scene.duration_s, static_cast<double>(last) * scene.step_s);
  for (const std::string& text : scene_warnings(filled, duration_s)) recorder.warn(text);
  Progress progress(last);
  StepInput input;
  for (std::uint64_t k = 1; k <= last; ++k) {
    input.samples = samples_of_traces(scene, k);
    const auto start = Clock::now();
    const StepOutput& output = simulation.step(input);
    recorder.add(output, std::chrono::duration<double>(Clock::now() - start).count());
    progress.show(output);
  }
  return recorder.finish();
}

}  // namespace sectio

#include "sim_server/session/offline_run.h"

#include <algorithm>
#include <chrono>

#include "sim_server/scene/scene_warnings.h"
#include "sim_server/session/progress.h"
#include "sim_server/session/run_files.h"
#include "sim_server/session/session_run.h"
#include "sim_server/session/trace_player.h"

namespace sectio {

RunResult run_offline(const Scene& scene, std::uint64_t steps, const std::string& directory) {
  using Clock = std::chrono::steady_clock;
  refuse_unfinished(directory);
  SessionRun run(scene, directory);
  const std::uint64_t last = steps_of(scene, steps);
  const double duration_s = std::max(scene.duration_s, static_cast<double>(last) * scene.step_s);
  for (const std::string& text : scene_warnings(scene, duration_s)) run.recorder().warn(text);
  Progress progress(last);
  StepInput input;
  for (std::uint64_t k = 1; k <= last; ++k) {
    input.samples = samples_of_traces(scene, k);
    const auto start = Clock::now();
    if (run.inputs()) run.begin_step(0, input);
    const StepOutput& output = run.step(input);
    run.end_step(output, std::chrono::duration<double>(Clock::now() - start).count());
    progress.show(output);
  }
  return run.recorder().finish();
}

}  // namespace sectio

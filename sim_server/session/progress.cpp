#include "sim_server/session/progress.h"

#include <cinttypes>

#include "common/core/formatted.h"
#include "common/core/log.h"

namespace sectio {

std::string progress_line(const StepOutput& output, std::optional<std::uint64_t> steps) {
  return "step " + std::to_string(output.step) + (steps ? " of " + std::to_string(*steps) : "") +
         formatted(", %.2f s simulated, %" PRIu64 " cuts", output.sim_time_s, output.report.cuts_made);
}

void Progress::show(const StepOutput& output) {
  const auto now = std::chrono::steady_clock::now();
  if (shown_ && now - *shown_ < std::chrono::seconds(1) && output.step != steps_) return;
  shown_ = now;
  log_info(progress_line(output, steps_));
}

}  // namespace sectio

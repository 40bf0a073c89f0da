// How far a run is, in the log.
#pragma once

#include <chrono>
#include <optional>

#include "sim_server/world/step_io.h"

namespace sectio {

// "step 120 of 6500, ...", at most once a second unless it is the last step.
class Progress {
 public:
  // Nothing: a run without end.
  explicit Progress(std::optional<std::uint64_t> steps) : steps_(steps) {}
  void show(const StepOutput& output);

 private:
  std::optional<std::uint64_t> steps_;
  std::optional<std::chrono::steady_clock::time_point> shown_;
};

// The line itself.
std::string progress_line(const StepOutput& output, std::optional<std::uint64_t> steps);

}  // namespace sectio

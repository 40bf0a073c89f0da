#include "sim_server/session/played_inputs.h"

#include <filesystem>

#include "common/core/error.h"

namespace sectio {

PlayedInputs::PlayedInputs(const std::string& path, SessionRun& run)
    : directory_(std::filesystem::path(path).parent_path().string()), journal_(path) {
  if (journal_.header().state_hash != state_hash_of(run.simulation()))
    throw InputError(path + ": the scene is not the one that it was made with");
}

bool PlayedInputs::take(SessionRun& run, StepInput& input) {
  const std::optional<StepInputs> inputs = journal_.next();
  if (!inputs) {
    if (!journal_.damage().empty()) run.recorder().not_ok(journal_.damage());
    return false;
  }
  const StepRecord& record = inputs->steps.front();
  const std::string why = difference(record, run.simulation());
  if (!why.empty()) run.recorder().not_ok("step " + std::to_string(record.step) + ": " + why);
  input = input_of(record);
  return why.empty();
}

void PlayedInputs::run_unseen(SessionRun& run, double step_s, double until_s) {
  run.jump(directory_, steps_until(until_s, step_s), journal_);
  StepInput input;
  while (static_cast<double>(run.steps()) * step_s < until_s && take(run, input)) {
    run.begin_step(0, input);
    run.end_step(run.step(input), 0);
  }
}

}  // namespace sectio

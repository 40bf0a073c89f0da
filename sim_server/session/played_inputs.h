// The inputs of a journal, for a session that is played again.
#pragma once

#include <string>

#include "sim_server/session/input_log.h"
#include "sim_server/session/session_run.h"

namespace sectio {

class PlayedInputs {
 public:
  // Throws InputError when `run`, at its beginning, is not what the journal was made with.
  PlayedInputs(const std::string& path, SessionRun& run);

  // The input of the next step of `run`. False at the end, and where the simulation isn't the one that was recorded.
  bool take(SessionRun& run, StepInput& input);
  // The steps that come before the ones to be seen, from the last checkpoint beside the journal on.
  void run_unseen(SessionRun& run, double step_s, double until_s);

 private:
  std::string directory_;
  InputLogReader journal_;
};

}  // namespace sectio

// A session again, from its journal of inputs.
#pragma once

#include <functional>
#include <string>

#include "sim_server/session/input_log.h"
#include "sim_server/simulation.h"

namespace sectio {

struct Rerun {
  std::uint64_t steps = 0;
  std::uint64_t last_epoch = 0;  // 0: there was no step
  std::string difference;        // "step 120: why", the first one; the run ends before it. Empty: there is none
};

using AfterStep = std::function<void(const StepInputs&, const StepOutput&)>;

// Runs the steps that the reader yields, up to `last_step`, on a simulation that has not begun, and compares it with
// the recorded one before each step. `after` is called after each of them. `steps_run`: those that the simulation and
// the reader have behind them already.
Rerun rerun(InputLogReader& reader, Simulation& simulation, const AfterStep& after, std::uint64_t last_step = kAllSteps,
            std::uint64_t steps_run = 0);

// For a person: `sim_server replay`. The simulation is as its session was at the end.
std::string rerun_report(InputLogReader& reader, Simulation& simulation, Rerun& run, const AfterStep& after,
                         std::uint64_t steps_run = 0);

}  // namespace sectio

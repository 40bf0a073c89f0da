#include "sim_server/session/rerun.h"

#include "common/core/error.h"
#include "common/core/report_figures.h"
#include "sim_server/session/step_record.h"

namespace sectio {

Rerun rerun(InputLogReader& reader, Simulation& simulation, const AfterStep& after, std::uint64_t last_step,
            std::uint64_t steps_run) {
  Rerun result;
  result.steps = steps_run;
  const auto differs = [&](const std::string& why) {
    result.difference = "step " + std::to_string(result.steps + 1) + ": " + why;
    return result;
  };
  if (steps_run == 0 && reader.header().state_hash != state_hash_of(simulation))
    return differs("the scene before it differs");
  while (result.steps < last_step) {
    const std::optional<StepInputs> inputs = reader.next();
    if (!inputs) break;
    const StepRecord& record = inputs->steps.front();
    if (result.steps == 0 && record.step > 1)
      throw InputError("the inputs begin with step " + std::to_string(record.step) +
                       ", as those of a server that went on with a session do: play shows what is there");
    if (record.step != result.steps + 1) return differs("it is not in the file");
    if (const std::string why = difference(record, simulation); !why.empty()) return differs(why);
    after(*inputs, simulation.step(input_of(record)));
    result.steps = record.step;
    result.last_epoch = inputs->epoch;
  }
  return result;
}

std::string rerun_report(InputLogReader& reader, Simulation& simulation, Rerun& run, const AfterStep& after,
                         std::uint64_t steps_run) {
  run = rerun(reader, simulation, after, kAllSteps, steps_run);
  const bool same = run.difference.empty();
  std::string lines = std::to_string(run.steps) + " steps\n";
  if (steps_run > 0) lines = "from the checkpoint of step " + std::to_string(steps_run) + " to " + lines;
  if (!same) lines += "differs from the recorded session at " + run.difference + "\n";
  // A file that differs was not read to its end, which is no damage.
  if (same && !reader.note().empty()) lines += reader.note() + "\n";
  for (std::uint32_t b = 0; b < simulation.body_count(); ++b)
    lines += simulation.body(b).name + ": revision " + std::to_string(simulation.mesh(b).revision()) +
             ", topology hash " + hash_text(simulation.mesh(b).hash()) + "\n";
  return lines;
}

}  // namespace sectio

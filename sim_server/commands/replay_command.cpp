#include <cstdio>
#include <filesystem>

#include "common/core/error.h"
#include "common/core/log.h"
#include "sim_server/commands/commands.h"
#include "sim_server/commands/recorded_scene.h"
#include "sim_server/session/replay.h"
#include "sim_server/session/rerun.h"
#include "sim_server/session/session_run.h"
#include "sim_server/session/verdict.h"

namespace sectio {
namespace {

// Runs the inputs of a session through the simulation again.
int replay_inputs(const std::string& path, double from_s) {
  InputLogReader reader(path);
  if (from_s > 0 && is_mcap(path))
    throw InputError("--from-s: a record has no checkpoints, as DIRECTORY/inputs of an --export has: " + path);
  const Scene scene = recorded_scene(path);
  SessionRun run(scene, "");
  const std::uint64_t from_step = steps_until(from_s, scene.step_s);
  if (from_s > 0 && reader.header().state_hash == run.header().state_hash)
    run.jump(std::filesystem::path(path).parent_path().string(), from_step, reader);
  Rerun again;
  const auto after = [&](const StepInputs&, const StepOutput& output) {
    if (scene.exercise) run.recorder().add(output, 0);
  };
  std::fputs(rerun_report(reader, run.simulation(), again, after, run.steps()).c_str(), stdout);
  if (scene.exercise && again.difference.empty())
    for (const std::string& line : run.recorder().score_lines()) std::puts(line.c_str());
  if (from_s > 0 && again.difference.empty() && again.steps <= from_step)
    throw InputError("--from-s: the inputs end at step " + std::to_string(again.steps) +
                     ", before that moment: " + path);
  return again.difference.empty() && reader.damage().empty() ? 0 : kExitNotOk;
}

}  // namespace

Arguments::Action replay_command(Arguments& arguments) {
  struct Flags {
    std::string journal, directory;
    double from_s = 0;
  };
  const auto flags = std::make_shared<Flags>();
  arguments.option(
      "JOURNAL", flags->journal,
      "journal, inputs or --record of an earlier run, or the directory of its --export, whose inputs it takes; inputs "
      "are simulated again, and every hash is compared",
      Need::required);
  arguments.option("--export", flags->directory, "directory for the surfaces (OBJ, at rest), of a journal");
  arguments.option("--from-s", flags->from_s,
                   "simulated time: DIRECTORY/inputs is compared from the last checkpoint before it on");
  return [flags] {
    if (!(flags->from_s >= 0)) throw InputError("--from-s: expected >= 0, got " + std::to_string(flags->from_s));
    flags->journal = journal_at(flags->journal);
    if (is_input_log(flags->journal)) return replay_inputs(flags->journal, flags->from_s);
    if (flags->from_s > 0)
      throw InputError("--from-s: only DIRECTORY/inputs has checkpoints beside it: " + flags->journal);
    std::string damage;
    std::fputs(replay(flags->journal, flags->directory, damage).c_str(), stdout);
    if (!damage.empty()) log_warning(damage + ": read as far as it is whole");
    return damage.empty() ? 0 : kExitNotOk;
  };
}

}  // namespace sectio

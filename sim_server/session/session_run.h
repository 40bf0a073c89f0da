// A session as it runs: a simulation, what it leaves behind, and the journal of its inputs, from which it can go on.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim_server/session/checkpoint.h"
#include "sim_server/session/input_log.h"
#include "sim_server/session/recorder.h"
#include "sim_server/session/run_files.h"
#include "sim_server/session/step_record.h"
#include "sim_server/simulation.h"

namespace sectio {

class SessionRun {
 public:
  // `scene`: a prepared one, which outlives the run. With a directory: leaves there what Recorder does,
  // and the journal of inputs. Throws InputError when it can't be written.
  SessionRun(const Scene& scene, const std::string& directory);

  // A session that goes on from its journal of inputs: from its end or, in another directory, from an earlier step on.
  // The steps after its last checkpoint (session/checkpoint.h) are run again; of a record all of them.
  struct Past {
    std::string directory;  // or the record
    std::uint64_t last_step = kAllSteps;
  };
  // `last_epoch`: the one that the session had last; nothing when it had not begun. Throws InputError when it is the
  // journal of another scene or of another version.
  static std::unique_ptr<SessionRun> resumed(const Scene& scene, const Past& past, const std::string& directory,
                                             std::optional<std::uint64_t>& last_epoch);

  // Goes to the last checkpoint of a session up to a step, if that is ahead and `inputs`, the journal in its directory,
  // reaches so far: then that goes on there. False: there is none, and both are where they were.
  bool jump(const std::string& directory, std::uint64_t last_step, InputLogReader& inputs);

  // Runs one step: the input is kept before. `record`: what others need to run it, too. The output is valid until the
  // next step.
  StepRecord begin_step(std::uint64_t epoch, const StepInput& input);
  const StepOutput& step(const StepInput& input) { return simulation_.step(input); }
  void end_step(const StepOutput& output, double step_wall_time_s);

  // Words about what could not be kept since the last call; each is in the log and in the report, too.
  std::vector<std::string> take_faults();

  std::uint64_t steps() const { return steps_; }  // steps that have been run
  Simulation& simulation() { return simulation_; }
  Recorder& recorder() { return *recorder_; }
  // The beginning of its journal: the simulation as it was before the first step.
  const InputLogHeader& header() const { return header_; }
  // Kept by somebody, it keeps other runs out of the directory when this one is gone.
  const std::shared_ptr<DirectoryLock>& directory_lock() const { return lock_; }
  InputLog* inputs() { return inputs_.get(); }  // null: they are not kept

 private:
  SessionRun(const Scene& scene, const std::string& directory, bool fresh);
  void begin();
  void keep(const StepInputs& one_step);
  void keep_checkpoint();
  void note_fault();

  const Scene& scene_;
  const std::string directory_;
  std::shared_ptr<DirectoryLock> lock_;
  Simulation simulation_;
  std::unique_ptr<Recorder> recorder_;
  InputLogHeader header_;
  std::unique_ptr<InputLog> inputs_;
  std::unique_ptr<CheckpointWriter> checkpoints_;  // null: none are kept
  std::uint64_t steps_ = 0, epoch_ = 0, checkpoint_at_ = 0;
  std::chrono::steady_clock::time_point next_checkpoint_{};
  bool goes_on_ = false;  // a step has been run that was not in the journal
};

}  // namespace sectio

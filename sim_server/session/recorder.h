// Collects the results of a run for its report.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sim_server/session/verdict.h"
#include "sim_server/simulation.h"

namespace sectio {

class Archive;

// Gathers a run's figures. With a directory, leaves there BODY.obj of every final surface, journal (all deltas, and
// twice a second the scalars that engines publish) and report.json. A disk that is full ends no run: a warning says
// what isn't kept, and the report that this is not ok.
class Recorder {
 public:
  // Makes the directory; empty: nothing is written. Throws InputError when it can't be written. Logs notes on the
  // meshes. Scene and simulation must outlive the recorder; add() comes right after the step.
  Recorder(const Scene& scene, const Simulation& simulation, const std::string& directory);
  ~Recorder();

  // Removes the report of an earlier run, which says that the session has ended, and the parts that came off its
  // bodies.
  void forget_report();
  // The journal begins with the bodies as they are.
  void begin_journal();
  // Continues a journal of which so many bytes are of steps that have been run; in another directory with a copy.
  void continue_journal(const std::string& former_directory, std::uint64_t bytes);
  std::uint64_t journal_bytes() const;  // 0: there is none
  // Writes or reads what has been gathered, but for the times of steps (common/math/archive.h).
  void archive(Archive& a);

  void add(const StepOutput& output, double step_wall_time_s);
  // Into the log and the report, each text once.
  void warn(const std::string& text);
  // The same where something that was asked for isn't there: the run is not ok.
  void not_ok(const std::string& text);
  // The texts that not_ok() has been given since the last call.
  std::vector<std::string> take_faults();
  // The score of the exercise so far, for a person; a line that says so when the scene has none.
  std::vector<std::string> score_lines() const;
  // Live sessions only: the time that publishing took after a step.
  void add_publish(double time_s);
  void set(const SyncCost& cost);
  // Writes the files.
  RunResult finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace sectio

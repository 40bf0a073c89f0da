#include "sim_server/session/session_run.h"

#include <filesystem>

#include "common/core/error.h"
#include "common/core/log.h"
#include "common/core/processor_time.h"
#include "sim_server/session/rerun.h"

namespace sectio {

SessionRun::SessionRun(const Scene& scene, const std::string& directory, bool fresh)
    : lock_(directory), simulation_(scene), recorder_(scene, simulation_, directory) {
  simulation_.measure_with(processor_time_s);
  if (!scene.file.empty()) header_.scene = std::filesystem::absolute(scene.file).string();
  for (const BodySpec& body : scene.bodies) header_.bodies.push_back(body.name);
  header_.state_hash = state_hash_of(simulation_);
  if (fresh && !directory.empty()) inputs_ = std::make_unique<InputLog>(input_log_path(directory), header_);
}

SessionRun::SessionRun(const Scene& scene, const std::string& directory) : SessionRun(scene, directory, true) {}

std::unique_ptr<SessionRun> SessionRun::resumed(const Scene& scene, const Past& past, const std::string& directory,
                                                std::optional<std::uint64_t>& last_epoch) {
  const std::string path = input_log_path(past.directory);
  const bool elsewhere = past.directory != directory;
  InputLogReader reader(path);
  std::unique_ptr<SessionRun> run(new SessionRun(scene, directory, elsewhere));
  const auto after = [&](const StepInputs& inputs, const StepOutput& output) {
    run->recorder_.add(output, 0);
    if (elsewhere) run->keep(inputs);
  };
  const Rerun done = rerun(reader, run->simulation_, after, past.last_step);
  if (!done.difference.empty())
    throw InputError(path + ": the simulation is not the one that wrote it: " + done.difference);
  if (done.steps < past.last_step && !reader.damage().empty()) run->recorder_.warn(reader.damage());
  if (done.steps > 0) last_epoch = done.last_epoch;
  run->steps_ = done.steps;
  if (!elsewhere) run->inputs_ = std::make_unique<InputLog>(path, reader.whole_bytes());
  log_info("the session goes on after step " + std::to_string(done.steps));
  return run;
}

void SessionRun::keep(const StepInputs& one_step) {
  if (!inputs_) return;
  const auto fault = inputs_->append(one_step);
  if (!fault) return;
  recorder_.warn(*fault);
  faults_.push_back(*fault);
}

StepRecord SessionRun::begin_step(std::uint64_t epoch, const StepInput& input) {
  StepRecord record = record_of(steps_ + 1, input, simulation_);
  keep({epoch, steps_, {record}});
  return record;
}

void SessionRun::end_step(const StepOutput& output, double step_wall_time_s) {
  steps_ = output.step;
  recorder_.add(output, step_wall_time_s);
}

std::vector<std::string> SessionRun::take_faults() {
  std::vector<std::string> faults = std::move(faults_);
  faults_.clear();
  for (std::string& fault : recorder_.take_faults()) faults.push_back(std::move(fault));
  return faults;
}

}  // namespace sectio

#include "sim_server/session/session_run.h"

#include <cinttypes>
#include <filesystem>
#include <utility>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/core/log.h"
#include "common/core/processor_time.h"
#include "common/math/archive.h"
#include "sim_server/session/rerun.h"

namespace sectio {
namespace {

constexpr double kCheckpointEvery_s = 1;  // simulated time
constexpr int kMostCost = 50;             // a checkpoint takes this thread for one part in so many, at most

}  // namespace

SessionRun::SessionRun(const Scene& scene, const std::string& directory, bool fresh)
    : scene_(scene), directory_(directory), lock_(std::make_shared<DirectoryLock>(directory)), simulation_(scene) {
  begin();
  if (!scene.file.empty()) header_.scene = std::filesystem::absolute(scene.file).string();
  for (const BodySpec& body : scene.bodies) header_.bodies.push_back(body.name);
  header_.state_hash = state_hash_of(simulation_);
  header_.session = scene.session;
  if (!fresh) return;
  recorder_->forget_report();
  recorder_->begin_journal();
  if (directory.empty()) return;
  inputs_ = std::make_unique<InputLog>(input_log_path(directory), header_);
  checkpoints_ = std::make_unique<CheckpointWriter>(directory, true, 0);
}

SessionRun::SessionRun(const Scene& scene, const std::string& directory) : SessionRun(scene, directory, true) {}

void SessionRun::begin() {
  simulation_.measure_with(processor_time_s);
  recorder_ = std::make_unique<Recorder>(scene_, simulation_, directory_);
}

std::unique_ptr<SessionRun> SessionRun::resumed(const Scene& scene, const Past& past, const std::string& directory,
                                                std::optional<std::uint64_t>& last_epoch) {
  const std::string path = input_log_path(past.directory);
  const bool elsewhere = past.directory != directory;
  InputLogReader reader(path);
  std::unique_ptr<SessionRun> run(new SessionRun(scene, directory, false));
  std::optional<std::uint64_t> inputs_bytes;
  if (reader.header().state_hash == run->header_.state_hash && run->jump(past.directory, past.last_step, reader))
    inputs_bytes = reader.whole_bytes();
  const std::uint64_t jumped = run->steps_;
  if (inputs_bytes && !elsewhere)
    if (InputLogReader before(path); !before.pass(*inputs_bytes))
      run->recorder_->not_ok(formatted("%s: damaged at byte %" PRIu64 ": the session goes on from its checkpoint of "
                                       "step %" PRIu64 ", and can't be simulated again",
                                       path.c_str(), before.whole_bytes(), jumped));
  if (!inputs_bytes) run->recorder_->begin_journal();
  if (inputs_bytes && elsewhere && !copy_beginning(path, input_log_path(directory), *inputs_bytes))
    throw InputError(path + ": can't be copied");
  if (inputs_bytes && elsewhere)
    run->inputs_ = std::make_unique<InputLog>(input_log_path(directory), *inputs_bytes, *inputs_bytes, jumped);
  else if (elsewhere)
    run->inputs_ = std::make_unique<InputLog>(input_log_path(directory), run->header_);
  const auto after = [&](const StepInputs& inputs, const StepOutput& output) {
    run->recorder_->add(output, 0);
    if (elsewhere) run->keep(inputs);
  };
  const Rerun done = rerun(reader, run->simulation_, after, past.last_step, jumped);
  if (!done.difference.empty())
    throw InputError(path + ": the simulation is not the one that wrote it: " + done.difference);
  if (done.steps < past.last_step && !reader.damage().empty()) {
    const bool goes_back = past.last_step != kAllSteps;
    if (goes_back && !reader.is_torn()) throw InputError(reader.damage());
    if (elsewhere || reader.is_torn())
      run->recorder_->warn(reader.damage());
    else
      run->recorder_->not_ok(reader.damage() + ", and kept in " + keep_rest(path, reader.whole_bytes()));
  }
  if (done.steps > jumped) run->epoch_ = done.last_epoch;
  if (done.steps > 0) last_epoch = run->epoch_;
  run->steps_ = run->checkpoint_at_ = done.steps;
  if (elsewhere)
    share_checkpoints(past.directory, directory, done.steps);
  else
    run->inputs_ = std::make_unique<InputLog>(path, reader.whole_bytes(), inputs_bytes.value_or(0), jumped);
  run->checkpoints_ = std::make_unique<CheckpointWriter>(directory, false, done.steps);
  log_info("the session goes on after step " + std::to_string(done.steps) +
           (jumped > 0 ? ", from the checkpoint of step " + std::to_string(jumped) : ""));
  return run;
}

bool SessionRun::jump(const std::string& directory, std::uint64_t last_step, InputLogReader& inputs) {
  for (std::uint64_t most = last_step;;) {
    const std::optional<Checkpoint> to = find_checkpoint(directory, header_.state_hash, most);
    if (!to || to->step <= steps_) return false;
    try {
      simulation_.load(to->simulation);
      if (state_hash_of(simulation_) != to->state_hash) throw InputError("it is of another state");
      Archive recorder(to->recorder);
      recorder_->archive(recorder);
      recorder_->continue_journal(directory, to->journal_bytes);
      if (!inputs.seek(to->inputs_bytes)) throw InputError("the journal of inputs ends before it");
      steps_ = checkpoint_at_ = to->step;
      epoch_ = to->epoch;
      return true;
    } catch (const InputError& error) {
      log_warning("the checkpoint of step " + std::to_string(to->step) + " is passed over: " + error.what());
      simulation_ = Simulation(scene_);
      begin();
      if (to->step == 0) return false;
      most = to->step - 1;
    }
  }
}

void SessionRun::keep(const StepInputs& one_step) {
  if (!inputs_) return;
  const auto fault = inputs_->append(one_step);
  if (!fault) return;
  checkpoints_.reset();  // nothing would lead on from them
  recorder_->not_ok(*fault);
}

StepRecord SessionRun::begin_step(std::uint64_t epoch, const StepInput& input) {
  epoch_ = epoch;
  if (!std::exchange(goes_on_, true)) recorder_->forget_report();
  StepRecord record = record_of(steps_ + 1, input, simulation_);
  keep({epoch, steps_, {record}});
  return record;
}

void SessionRun::end_step(const StepOutput& output, double step_wall_time_s) {
  steps_ = output.step;
  recorder_->add(output, step_wall_time_s);
  if (checkpoints_ && static_cast<double>(steps_ - checkpoint_at_) * scene_.step_s >= kCheckpointEvery_s &&
      std::chrono::steady_clock::now() >= next_checkpoint_ && checkpoints_->is_ready())
    keep_checkpoint();
}

void SessionRun::keep_checkpoint() {
  note_fault();
  const auto begun = std::chrono::steady_clock::now();
  Checkpoint now{header_.state_hash,         steps_, epoch_, state_hash_of(simulation_), inputs_->bytes(),
                 recorder_->journal_bytes(), {},     {}};
  auto simulation = simulation_.save();
  if (!simulation) {
    log_info("no checkpoints are kept: an engine of this scene doesn't say its state");
    checkpoints_.reset();
    return;
  }
  now.simulation = std::move(*simulation);
  Archive recorder(now.recorder);
  recorder_->archive(recorder);
  checkpoints_->put(std::move(now));
  checkpoint_at_ = steps_;
  const auto now_at = std::chrono::steady_clock::now();
  next_checkpoint_ = now_at + kMostCost * (now_at - begun);
}

void SessionRun::note_fault() {
  const auto fault = checkpoints_ ? checkpoints_->take_fault() : std::nullopt;
  if (!fault) return;
  recorder_->not_ok(*fault);
}

std::vector<std::string> SessionRun::take_faults() {
  note_fault();
  return recorder_->take_faults();
}

}  // namespace sectio

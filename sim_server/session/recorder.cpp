#include "sim_server/session/recorder.h"

#include <algorithm>
#include <cinttypes>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/core/log.h"
#include "common/core/processor_time.h"
#include "common/core/write_file.h"
#include "common/delta/journal.h"
#include "common/math/archive.h"
#include "common/mesh/check.h"
#include "sim_server/session/blade_watch.h"
#include "sim_server/session/run_files.h"
#include "sim_server/session/run_outcome.h"

namespace sectio {
namespace {

constexpr double kScalarsEvery_s = 0.5;  // simulated time between the scalars of a journal
constexpr double kPauseInCut_s = 0.25;   // a longer one ends a cut

std::string journal_path(const std::string& directory) {
  return directory + "/journal";
}

std::string report_path(const std::string& directory) {
  return directory + "/report.json";
}

// The files of bodies that a run before has left, but for those of the scene's own bodies: parts that came off.
std::vector<std::string> files_of_parts(const Scene& scene, const std::string& directory) {
  std::ifstream file(report_path(directory));
  const nlohmann::json report = nlohmann::json::parse(file, nullptr, false);
  std::vector<std::string> parts;
  if (!report.is_object() || !report.contains("bodies") || !report["bodies"].is_array()) return parts;
  for (const nlohmann::json& body : report["bodies"]) {
    const bool has_name = body.is_object() && body.contains("name") && body["name"].is_string();
    const std::string name = has_name ? body["name"].get<std::string>() : "";
    const auto came_off = [&](const BodySpec& of) { return name.starts_with(of.name + "."); };
    if (std::ranges::any_of(scene.bodies, came_off)) parts.push_back(obj_path(directory, name));
  }
  return parts;
}

constexpr std::int64_t kHandlesOfCuts = 3;  // more than cuts leave that meet, or go through

std::int64_t handles_of(const SurfaceReport& surface) {
  return static_cast<std::int64_t>(surface.components) - surface.euler_characteristic / 2;
}

}  // namespace

struct Recorder::State {
  State(const Scene& s, const Simulation& w, const std::string& d)
      : scene(s), simulation(w), directory(d), outcome(w), blades(s) {}

  void gather(const StepOutput& output, double step_wall_time_s);
  void keep_journal(const StepOutput& output);
  void keep_scalars(std::uint64_t step);

  const Scene& scene;
  const Simulation& simulation;
  std::string directory;
  std::unique_ptr<JournalWriter> journal;
  std::optional<ExerciseScore> score;
  RunOutcome outcome;
  BladeWatch blades;
  std::vector<std::vector<ScalarField>> scalars;   // by body, as the journal has them
  std::uint64_t scalars_kept_at = 0;               // step
  Vec3 gravity_m_per_s2 = scene.gravity_m_per_s2;  // gravity that the journal has
  double processor_begun_s = processor_time_s();
  std::vector<std::int64_t> handles_begun;  // by body
  RunFigures figures;
  std::vector<std::string> faults;  // faults since they were last taken
  std::vector<std::string> lost;    // all losses
};

Recorder::Recorder(const Scene& scene, const Simulation& simulation, const std::string& directory)
    : state_(std::make_unique<State>(scene, simulation, directory)) {
  for (std::uint32_t i = 0; i < simulation.body_count(); ++i)
    for (const std::string& note : simulation.body(i).mesh_notes) log_info(simulation.body(i).name + ": " + note);
  for (std::uint32_t i = 0; i < simulation.body_count(); ++i)
    state_->handles_begun.push_back(handles_of(check(simulation.mesh(i))));
  if (scene.exercise) state_->score.emplace(scene, simulation);
  if (!directory.empty()) make_directory(directory);
}

Recorder::~Recorder() = default;

void Recorder::forget_report() {
  std::error_code none;
  if (state_->directory.empty()) return;
  for (const std::string& part : files_of_parts(state_->scene, state_->directory)) std::filesystem::remove(part, none);
  std::filesystem::remove(report_path(state_->directory), none);
}

void Recorder::begin_journal() {
  if (state_->directory.empty()) return;
  std::vector<JournalBody> bodies;
  for (std::uint32_t i = 0; i < state_->simulation.body_count(); ++i)
    bodies.push_back({state_->simulation.body(i).name, state_->simulation.mesh(i)});
  state_->journal = std::make_unique<JournalWriter>(journal_path(state_->directory), bodies);
}

void Recorder::continue_journal(const std::string& former_directory, std::uint64_t bytes) {
  if (state_->directory.empty()) return;
  const std::string path = journal_path(state_->directory), former = journal_path(former_directory);
  if (bytes > 0 && copy_beginning(former, path, bytes)) {
    state_->journal = std::make_unique<JournalWriter>(path, bytes, state_->simulation.body_count());
  } else {
    warn(former + ": it ends too early: the journal begins with the bodies as they are");
    begin_journal();
  }
}

std::uint64_t Recorder::journal_bytes() const {
  return state_->journal ? state_->journal->bytes() : 0;
}

void Recorder::archive(Archive& a) {
  State& s = *state_;
  if (s.score) a(*s.score);
  a(s.outcome, s.blades, s.scalars, s.scalars_kept_at, s.gravity_m_per_s2, s.figures);
}

void Recorder::add(const StepOutput& output, double step_wall_time_s) {
  State& s = *state_;
  if (s.journal) {
    try {
      s.keep_journal(output);
    } catch (const InputError& error) {
      s.journal.reset();
      not_ok(error.what());
    }
  }
  if (s.score) s.score->add(output);
  s.outcome.add(output);
  s.gather(output, step_wall_time_s);
  for (const std::string& text : s.blades.add(output)) warn(text);
  for (const Event& e : output.events)
    if (e.kind == EventKind::island_kept) warn(e.text);
}

void Recorder::State::keep_journal(const StepOutput& output) {
  for (const BodyDelta& d : output.deltas) journal->append(d.body_id, d.delta);
  for (const NewBody& b : output.new_bodies) journal->append({b.name, simulation.mesh(b.body_id)});
  if (output.gravity_target_m_per_s2 != gravity_m_per_s2)
    journal->append({output.step, output.gravity_target_m_per_s2});
  gravity_m_per_s2 = output.gravity_target_m_per_s2;
  if (static_cast<double>(output.step - scalars_kept_at) * scene.step_s >= kScalarsEvery_s) keep_scalars(output.step);
}

// Only fields that have changed since they were last kept.
void Recorder::State::keep_scalars(std::uint64_t step) {
  scalars_kept_at = step;
  scalars.resize(simulation.body_count());
  for (std::uint32_t b = 0; b < simulation.body_count(); ++b) {
    std::vector<ScalarField> now = simulation.scalars(b);
    for (const ScalarField& field : now)
      if (std::ranges::find(scalars[b], field) == scalars[b].end()) journal->append(JournalScalars{step, b, field});
    scalars[b] = std::move(now);
  }
}

void Recorder::State::gather(const StepOutput& output, double step_wall_time_s) {
  RunFigures& f = figures;
  f.step_times.add(step_wall_time_s);
  f.last = output.report;
  f.body_cpu_s.resize(output.report.checks.size(), 0);
  f.body_residual_m.resize(output.report.checks.size(), 0);
  f.body_residual.resize(output.report.checks.size(), 0);
  f.body_added_mass.resize(output.report.checks.size(), 0);
  f.body_cuts.resize(output.report.checks.size());
  const auto pause = static_cast<std::uint64_t>(kPauseInCut_s / scene.step_s);
  for (std::size_t b = 0; b < f.body_cpu_s.size(); ++b) {
    const bool changed =
        std::ranges::any_of(output.deltas, [&](const BodyDelta& d) { return d.body_id == b && !d.delta.empty(); });
    f.body_cuts[b].add(output.step, changed, output.report.processor_s[b] - f.body_cpu_s[b], pause);
    f.body_residual[b] = std::max(f.body_residual[b], output.report.drivers[b].residual);
    f.body_added_mass[b] = std::max(f.body_added_mass[b], output.report.drivers[b].added_mass_fraction);
    f.body_cpu_s[b] = output.report.processor_s[b];
    f.body_residual_m[b] = std::max(f.body_residual_m[b], output.report.checks[b].residual_m);
  }
  f.steps = output.step;
  f.body_steps += simulation.body_count();
  f.body_steps_asleep += output.report.bodies_asleep;
  for (const Event& e : output.events) {
    ++f.events[to_string(e.kind)];
    f.strokes.add(e);
    if (e.kind == EventKind::instrument_withdrawn) log_warning(e.text);
    if (e.kind == EventKind::contact_ended && !e.text.empty()) log_limited(LogLevel::info, "contact ended", e.text);
    if (e.kind == EventKind::did_not_cut) log_limited(LogLevel::info, "did not cut", e.text);
    if (e.kind != EventKind::cut_refused) continue;
    ++f.refusals[e.text];
    log_limited(LogLevel::warning, "cut refused", "cut refused: " + e.text);
  }
  f.least_margin = std::min(f.least_margin, output.report.stability_margin);
  f.largest_penetration_m = std::max(f.largest_penetration_m, output.report.penetration_m);
  f.largest_added_mass = std::max(f.largest_added_mass, output.report.added_mass_fraction);
  for (const ContactModel& c : output.contacts) f.largest_force_n = std::max(f.largest_force_n, c.force_world_n.norm());
}

void Recorder::warn(const std::string& text) {
  std::vector<std::string>& warnings = state_->figures.warnings;
  if (std::ranges::find(warnings, text) != warnings.end()) return;
  warnings.push_back(text);
  log_warning(text);
}

void Recorder::not_ok(const std::string& text) {
  if (std::ranges::find(state_->lost, text) != state_->lost.end()) return;
  warn(text);
  state_->faults.push_back(text);
  state_->lost.push_back(text);
}

std::vector<std::string> Recorder::take_faults() {
  return std::exchange(state_->faults, {});
}

std::vector<std::string> Recorder::score_lines() const {
  if (!state_->score) return {"this scene has no exercise: nothing is scored"};
  RunFigures so_far = state_->figures;
  so_far.score = state_->score->finish();
  so_far.overlaps = state_->simulation.overlaps();
  std::vector<std::string> lines = to_lines(*so_far.score);
  const Outcome outcome = state_->outcome.finish(so_far);
  for (const Expectation& e : state_->scene.expect) {
    const double got = outcome.*e.measure->value;
    const bool has_no_value = e.measure->of == MeasureOf::line && !so_far.score->line->has_cuts();
    lines.push_back((e.range.contains(got) ? "reached                 " : "missed                  ") +
                    target_in_words(e) + ": " +
                    (has_no_value ? "nothing was cut at it" : value_in_words(*e.measure, got)));
  }
  return lines;
}

void Recorder::add_publish(double time_s) {
  state_->figures.publish_times.add(time_s);
}

void Recorder::set(const SyncCost& cost) {
  state_->figures.cost = cost;
}

RunResult Recorder::finish() {
  State& s = *state_;
  s.figures.processor_s = processor_time_s() - s.processor_begun_s;
  if (s.score) {
    s.figures.score = s.score->finish();
    for (const std::string& line : to_lines(*s.figures.score)) log_info(line);
  }
  s.figures.overlaps = s.simulation.overlaps();
  s.figures.outcome = s.outcome.finish(s.figures);
  for (const std::string& text : s.blades.finish()) warn(text);
  for (std::uint32_t i = 0; i < s.simulation.body_count(); ++i) {
    const std::int64_t now = handles_of(check(s.simulation.mesh(i))),
                       begun = i < s.handles_begun.size() ? s.handles_begun[i] : 0;
    if (now > begun + kHandlesOfCuts)
      warn(formatted("%s has %" PRId64 " handles, and had %" PRId64
                     ": its cuts have left threads of tissue between them",
                     s.simulation.body(i).name.c_str(), now, begun));
  }
  RunResult result;
  const std::vector<std::string> reasons = reasons_against(s.figures, s.scene, s.simulation);
  for (const std::string& reason : reasons) log_warning("not ok: " + reason);
  const auto report = [&] {
    result.reasons = reasons;
    result.reasons.insert(result.reasons.end(), s.lost.begin(), s.lost.end());
    result.report = report_text(s.figures, s.scene, s.simulation, result.reasons);
  };
  const auto try_to = [&](const auto& write) {
    try {
      write();
    } catch (const InputError& error) {
      not_ok(error.what());
      return false;
    }
    return true;
  };
  if (s.journal && s.figures.steps > s.scalars_kept_at) try_to([&] { s.keep_scalars(s.figures.steps); });
  s.journal.reset();  // closes the file
  for (std::uint32_t i = 0; !s.directory.empty() && i < s.simulation.body_count(); ++i)
    try_to([&] {
      write_obj(obj_path(s.directory, s.simulation.body(i).name), s.simulation.mesh(i),
                s.simulation.positions_world_m(i));
    });
  report();
  if (!s.directory.empty() && !try_to([&] { write_file(report_path(s.directory), result.report); })) report();
  return result;
}

}  // namespace sectio

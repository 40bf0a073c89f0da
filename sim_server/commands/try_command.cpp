#include <algorithm>
#include <cstdio>

#include "common/core/error.h"
#include "common/core/log.h"
#include "common/core/stop_signal.h"
#include "sim_server/commands/commands.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/session/run_files.h"
#include "sim_server/session/verdict.h"
#include "sim_server/trials/trials.h"
#include "sim_server/trials/write_scene.h"

namespace sectio {
namespace {

struct Flags {
  std::string scene, failures;
  TrialsOptions options;
  double shift_mm = 0, tremor_mm = 0, back_mm = 0, at_least = 1;
};

void check(const Flags& flags) {
  const TrialsOptions& o = flags.options;
  const auto refuse_unless = [](bool good, const std::string& flaw) {
    if (!good) throw InputError(flaw);
  };
  refuse_unless(o.runs > 0, "--runs: expected > 0, got 0");
  refuse_unless(o.processes > 0 && o.processes <= 1000,
                "--processes: expected 1 to 1000, got " + std::to_string(o.processes));
  refuse_unless(o.processor_limit_s > 0, "--limit-s: expected > 0, got 0");
  const std::pair<const char*, double> lengths[] = {{"--shift-mm", flags.shift_mm},
                                                    {"--turn-deg", o.hand.turn_deg},
                                                    {"--tremor-mm", flags.tremor_mm},
                                                    {"--back-mm", flags.back_mm}};
  for (const auto& [flag, value] : lengths)
    refuse_unless(value >= 0, std::string(flag) + ": expected >= 0, got " + std::to_string(value));
  for (const auto& [flag, value] : {std::pair("--slower", o.hand.slower), std::pair("--faster", o.hand.faster)})
    refuse_unless(value > 0 && value <= 1000,
                  std::string(flag) + ": expected in (0, 1000], got " + std::to_string(value));
  refuse_unless(o.hand.slower == 1 || o.hand.faster == 1, "--slower: expected without --faster");
  refuse_unless(flags.back_mm == 0 || o.hand.lifts > 0, "--back-mm: needs --lifts, after which it is put down");
  refuse_unless(flags.at_least >= 0 && flags.at_least <= 1,
                "--at-least: expected in [0, 1], got " + std::to_string(flags.at_least));
}

std::string reasons_of(const Trial& trial) {
  std::string text;
  for (const std::string& reason : trial.reasons) text += (text.empty() ? "" : "; ") + reason;
  return text;
}

void make_failures(const std::string& directory) {
  try {
    if (!directory.empty()) make_directory(directory);
  } catch (const InputError& error) {
    throw InputError(std::string("--failures: ") + error.what());
  }
}

// Whether it is there, where one is asked for: a full disk ends no run.
bool keep_failure(const Scene& scene, const std::string& directory, std::uint64_t seed) {
  try {
    if (!directory.empty()) write_scene(scene, directory + "/" + std::to_string(seed));
    return true;
  } catch (const InputError& error) {
    log_error(error.what());
    return false;
  }
}

int try_scene(Flags flags) {
  check(flags);
  Hand& hand = flags.options.hand;
  hand.shift_m = 1e-3 * flags.shift_mm;
  hand.tremor_m = 1e-3 * flags.tremor_mm;
  hand.back_m = 1e-3 * flags.back_mm;
  Scene scene = load_scene(flags.scene, standard_traits());
  if (std::ranges::all_of(scene.tools, [](const ToolSpec& tool) { return tool.trace.empty(); }))
    throw InputError(flags.scene + (scene.tools.empty() ? ": it has no tools" : ": no tool has a trace") +
                     ", so every run would be the same: give a tool a `trace`, or play the scene once with --scene " +
                     flags.scene + " --offline");
  scene = prepared(std::move(scene));
  make_failures(flags.failures);
  if (scene.expect.empty()) log_warning(flags.scene + ": says nothing under expect:, so a run that ends well is ok");
  catch_stop_signals();
  std::uint32_t ended = 0, good = 0;
  bool kept = true;
  const std::vector<Trial> trials = run_trials(scene, flags.options, [&](const Trial& trial) {
    ++ended;
    good += trial.reasons.empty();
    log_info(std::to_string(ended) + " of " + std::to_string(flags.options.runs) + " runs, " + std::to_string(good) +
             " ok");
    if (trial.reasons.empty()) return;
    std::printf("seed %llu: %s\n", static_cast<unsigned long long>(trial.seed), reasons_of(trial).c_str());
    std::fflush(stdout);
    kept = keep_failure(in_hand(scene, hand, trial.seed), flags.failures, trial.seed) && kept;
  });
  const bool stopped = trials.size() < flags.options.runs;
  if (stopped)
    log_warning("stopped after " + std::to_string(trials.size()) + " of " + std::to_string(flags.options.runs) +
                " runs");
  if (trials.empty()) return 1;
  const Rate rate = rate_of(trials);
  const Interval interval = wilson(rate);
  std::printf("%s, %s: %u of %u, %.1f %% (95 %%: %.1f to %.1f %%)\n", flags.scene.c_str(), to_text(hand).c_str(),
              rate.good, rate.all, 100.0 * rate.good / rate.all, 100 * interval.low, 100 * interval.high);
  if (stopped || !kept) return 1;
  return rate.good >= flags.at_least * rate.all ? 0 : kExitNotOk;
}

}  // namespace

Arguments::Action try_command(Arguments& arguments) {
  const auto flags = std::make_shared<Flags>();
  TrialsOptions& options = flags->options;
  Hand& hand = options.hand;
  arguments.option("SCENE", flags->scene, "scene file (YAML)", Need::required);
  arguments.option("--runs", options.runs, "how often the scene is played");
  arguments.option("--seed", options.seed, "of the first run; each of the others has the next one");
  arguments.option("-j,--processes", options.processes, "runs at the same time");
  arguments.option("--shift-mm", flags->shift_mm, "all traces are moved by at most so much, in any direction");
  arguments.option("--turn-deg", hand.turn_deg, "all traces are turned by at most so much about a vertical axis");
  arguments.option("--slower", hand.slower, "the hand takes so many times as long");
  arguments.option("--faster", hand.faster, "the hand is so many times as fast");
  arguments.option("--tremor-mm", flags->tremor_mm, "the hand trembles at 8 to 12 Hz, with this root mean square");
  arguments.option("--lifts", hand.lifts, "times that what cuts is lifted out of the tissue and put down again");
  arguments.option("--back-mm", flags->back_mm, "it is put down at most so far behind where it was lifted");
  arguments.option("--pauses", hand.pauses, "times that the hand stands still for a second");
  arguments.option("--saws", hand.saws,
                   "times that what cuts goes some millimetres back along its way and forth again");
  arguments.option("--at-least", flags->at_least, "exit code 3 when a smaller share of the runs is ok");
  arguments.option("--failures", flags->failures,
                   "directory: leaves SEED/scene.yaml, with its traces, for each run that was not ok");
  arguments.option("--limit-s", options.processor_limit_s, "processor's time after which a run has failed");
  return [flags] { return try_scene(*flags); };
}

}  // namespace sectio

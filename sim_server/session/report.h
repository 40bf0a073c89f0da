// The report of a run: report.json, and what the program prints in the end.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/core/time_digest.h"
#include "sim_server/session/exercise_score.h"
#include "sim_server/session/stroke_log.h"
#include "sim_server/world/step_io.h"

namespace sectio {

// The cost of several copies of a body (paper A, conclusion): the copy of the simulation, the copy from which the
// network's thread serves viewers, and a copy in each viewer, which reports it.
struct SyncCost {
  std::size_t copy_bytes = 0;       // the network's thread: topology and positions
  double network_total_s = 0;       // the network's thread
  double waited_for_servers_s = 0;  // for others of the session, so that all stay together
  std::uint64_t deferred_steps = 0, reduced_steps = 0, slowed_steps = 0;  // see net/budget.h
  double most_behind_s = 0;
  std::uint64_t orders_refused = 0;  // they came too fast (net/order_limit.h)
};

// The processor's time of a body while it is cut: from the first change of its topology to the last one that follows
// within a quarter of a second.
struct CutCost {
  double time_s = 0;         // in steps in which its topology changes
  std::uint64_t steps = 0;   // number of these
  double while_s = 0;        // with the steps between
  std::uint64_t within = 0;  // number of these
  double since_s = 0;        // since the last change
  std::uint64_t last_step = 0;

  void add(std::uint64_t step, bool changed, double took_s, std::uint64_t longest_pause);

  template <class A>
  void archive(A& a) {
    a(time_s, steps, while_s, within, since_s, last_step);
  }
};

// The figures of a run, gathered step by step (Recorder).
struct RunFigures {
  std::uint64_t steps = 0, body_steps = 0, body_steps_asleep = 0;
  TimeDigest step_times, publish_times;           // wall clock
  double processor_s = 0;                         // processor's time of the whole run
  std::map<std::string, std::uint64_t> events;    // how many of each kind
  std::map<std::string, std::uint64_t> refusals;  // cuts that were refused, by reason
  StrokeLog strokes;
  std::vector<std::string> warnings;                   // each once
  std::vector<double> body_cpu_s, body_residual_m;     // by body: total so far; largest value
  std::vector<double> body_residual, body_added_mass;  // by body: largest value
  std::vector<CutCost> body_cuts;                      // by body
  double least_margin = 1e9, largest_penetration_m = 0, largest_force_n = 0, largest_added_mass = 0;
  StepReport last;  // report of the last step
  std::optional<SyncCost> cost;
  std::optional<Score> score;
  Outcome outcome;
  std::vector<BodyOverlap> overlaps;  // at the end

  // Without the times of steps, which are of this run, and what belongs to its end.
  template <class A>
  void archive(A& a) {
    a(steps, body_steps, body_steps_asleep, events, refusals, strokes, warnings, body_cpu_s, body_residual_m,
      body_residual, body_added_mass, body_cuts, least_margin, largest_penetration_m, largest_force_n,
      largest_added_mass, last);
  }
};

inline std::uint64_t count_of(const RunFigures& figures, EventKind kind) {
  const auto found = figures.events.find(to_string(kind));
  return found == figures.events.end() ? 0 : found->second;
}

// JSON: whether the run was ok, and the reasons (session/verdict.h) if it was not; for each body vertices, triangles,
// components, Euler characteristic, closed and manifold flags, volume now and at rest, revision and hash; for the run
// steps, cuts, contact time, step times, stability margin, warnings; the strokes. Times of steps and processor are the
// only numbers that differ between two runs on the same samples.
std::string report_text(const RunFigures& figures, const Scene& scene, const Simulation& simulation,
                        std::span<const std::string> reasons);

}  // namespace sectio

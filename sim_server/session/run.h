// A session around the simulation: the run without network, and what every run leaves behind.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim_server/prepare/choose_model.h"
#include "sim_server/simulation.h"

namespace sectio {

// What it costs that there are several copies of a body (paper A, conclusion): the simulation's, the one from which the
// network's thread serves viewers, and one in each viewer (its own report has that).
struct SyncCost {
  std::size_t copy_bytes = 0;       // of the network's thread: topology and positions
  double network_total_s = 0;       // of the network's thread
  double waited_for_servers_s = 0;  // for others of the session, so that all stay together
  std::uint64_t deferred_steps = 0, reduced_steps = 0, slowed_steps = 0;  // see net/budget.h
  double most_behind_s = 0;
};

// What a run leaves behind: with a directory, BODY.obj of every final surface, journal (all deltas) and report.json.
// Times of steps and processor are the only numbers in the report that differ between two runs on the same samples.
class RunRecord {
 public:
  // Makes the directory; empty: nothing is written. Throws InputError when it can't be written. Scene and
  // simulation must outlive the record; add() comes right after the step.
  RunRecord(const Scene& scene, const Simulation& simulation, const std::string& directory);
  ~RunRecord();

  void add(const StepOutput& output, double step_wall_time_s);
  // Of a live session; its samples are those of publishing after each step.
  void add_publish(double time_s);
  void set(const SyncCost& cost);
  // Writes what there is to write. Returns the report as JSON text: per body vertices, triangles, components, Euler
  // characteristic, closed and manifold flags, volume now and at rest, revision and hash; for the run steps, cuts,
  // contact time, step times, stability margin.
  std::string finish(const Simulation& simulation);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// The samples of the scene's traces that fall into a step, one a millisecond, as a device would send them.
std::vector<ToolSample> samples_of_traces(const Scene& scene, std::uint64_t step);

// Wavefront OBJ of the live surface, skin and wall as groups, in metres. Throws InputError when it can't be written.
void write_obj(const std::string& path, const TriangleMesh& mesh, std::span<const Vec3f> positions_world_m);

// "step 120 of 6500, ...", at most once a second unless it is the last step.
class Progress {
 public:
  explicit Progress(std::uint64_t steps) : steps_(steps) {}
  void show(const StepOutput& output);

 private:
  std::uint64_t steps_;
  std::optional<std::chrono::steady_clock::time_point> shown_;
};

// Steps of a run: `steps`, or the scene's duration when that is 0.
std::uint64_t steps_of(const Scene& scene, std::uint64_t steps);

// As fast as it goes, on the scene's own traces. Returns the report.
std::string run_offline(const Scene& scene, std::uint64_t steps, const std::string& directory);

// Runs it like this and says for each body how far pressing instruments were from the surface that they dented.
std::string measure_gaps(const Scene& scene);

// Rebuilds the bodies from a journal and says their hashes; with a directory, writes them as OBJ (at rest).
void replay(const std::string& journal, const std::string& export_directory);

}  // namespace sectio

// A session around the simulation: the run without network, and what every run leaves behind.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sim_server/simulation.h"

namespace sectio {

// Collects what report.json says. Step times are the only numbers in it that differ between two runs.
class RunReport {
 public:
  explicit RunReport(const Scene& scene);
  ~RunReport();

  void add(const StepOutput& output, double step_wall_time_s);
  // The report as JSON text: per body vertices, triangles, components, Euler characteristic, closed and manifold flags,
  // volume at rest and now, revision and hash; for the run steps, cuts, contact time, step times, stability margin.
  std::string json(const Simulation& simulation) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// The samples of the scene's traces that fall into a step, one a millisecond, as a device would send them.
std::vector<ToolSample> samples_of_traces(const Scene& scene, std::uint64_t step);

// Wavefront OBJ of the live surface, skin and wall as groups, in metres. Throws InputError when it can't be written.
void write_obj(const std::string& path, const TriangleMesh& mesh, std::span<const Vec3f> positions_world_m);

struct OfflineOptions {
  std::uint64_t steps = 0;       // 0: the scene's duration
  std::string export_directory;  // empty: nothing is written
};
// As fast as it goes, with a line of progress a second. Writes BODY.obj, journal and report.json. Returns the report.
std::string run_offline(const Scene& scene, const OfflineOptions& options);

// Rebuilds the bodies from a journal and says their hashes; with a directory, writes them as OBJ (at rest).
void replay(const std::string& journal, const std::string& export_directory);

}  // namespace sectio

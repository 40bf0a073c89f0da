#include "sim_server/session/run.h"
#include "sim_server/prepare/fill_volumes.h"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>

#include "common/core/error.h"
#include "common/core/log.h"
#include "common/core/processor_time.h"
#include "common/delta/journal.h"
#include "common/mesh/check.h"
#include "sim_server/session/exercise_score.h"

namespace sectio {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

std::string hex(std::uint64_t x) {
  char text[17];
  std::snprintf(text, sizeof text, "%016" PRIx64, x);
  return text;
}

// The value below which a fraction q of the samples lies.
double quantile(std::vector<float>& samples, double q) {
  if (samples.empty()) return 0;
  const auto at = samples.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(samples.size() - 1));
  std::nth_element(samples.begin(), at, samples.end());
  return static_cast<double>(*at);
}

void write_text(const std::string& path, const std::string& text) {
  std::ofstream file(path);
  if (!(file << text).flush()) throw InputError(path + ": can't be written");
}

void make_directory(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) throw InputError(path + ": can't be made: " + error.message());
}

std::string file_of(const std::string& directory, const std::string& body) {
  std::string name = body;
  std::replace(name.begin(), name.end(), '/', '_');
  return directory + "/" + name + ".obj";
}

}  // namespace

struct RunRecord::State {
  State(const Scene& s, const Simulation& w, const std::string& d) : scene(s), world(w), directory(d) {}

  void write(const Simulation& simulation, const std::string& json) const;
  nlohmann::ordered_json body(const Simulation& simulation, std::uint32_t id) const;
  nlohmann::ordered_json run();
  nlohmann::ordered_json session();
  static nlohmann::ordered_json exercise(const Score& score);

  const Scene& scene;
  const Simulation& world;
  std::string directory;
  std::unique_ptr<JournalWriter> journal;
  std::optional<ExerciseScore> score;
  Vec3 gravity_m_per_s2 = scene.gravity_m_per_s2;  // as the journal has it
  std::vector<float> step_times_s;
  std::vector<float> publish_times_s;
  std::optional<SyncCost> cost;
  double processor_begun_s = processor_time_s();
  StepReport last;
  std::uint64_t steps = 0, body_steps = 0, body_steps_asleep = 0;
  std::map<std::string, std::uint64_t> events, refusals;  // how many of each kind; of each reason
  std::vector<double> cpu_s, residual_m;                  // by body: so far; the most
  double least_margin = 1e9, largest_penetration_m = 0, largest_force_n = 0, largest_added_mass = 0;
};

RunRecord::RunRecord(const Scene& scene, const Simulation& simulation, const std::string& directory)
    : state_(std::make_unique<State>(scene, simulation, directory)) {
  if (scene.exercise) state_->score.emplace(scene, simulation);
  if (directory.empty()) return;
  make_directory(directory);
  std::vector<JournalBody> bodies;
  for (std::uint32_t i = 0; i < simulation.body_count(); ++i)
    bodies.push_back({simulation.body(i).name, simulation.mesh(i)});
  state_->journal = std::make_unique<JournalWriter>(directory + "/journal", bodies);
}

RunRecord::~RunRecord() = default;

void RunRecord::add(const StepOutput& output, double step_wall_time_s) {
  State& s = *state_;
  if (s.journal) {
    for (const BodyDelta& d : output.deltas) s.journal->append(d.body_id, d.delta);
    for (const NewBody& b : output.new_bodies) s.journal->append({b.name, s.world.mesh(b.body_id)});
    if (output.gravity_target_m_per_s2 != s.gravity_m_per_s2)
      s.journal->append({output.step, output.gravity_target_m_per_s2});
  }
  if (s.score) s.score->add(output);
  s.gravity_m_per_s2 = output.gravity_target_m_per_s2;
  s.step_times_s.push_back(static_cast<float>(step_wall_time_s));
  s.last = output.report;
  s.cpu_s.resize(output.report.checks.size(), 0);
  s.residual_m.resize(output.report.checks.size(), 0);
  for (std::size_t b = 0; b < s.cpu_s.size(); ++b) {
    s.cpu_s[b] = output.report.processor_s[b];
    s.residual_m[b] = std::max(s.residual_m[b], output.report.checks[b].residual_m);
  }
  s.steps = output.step;
  s.body_steps += s.world.body_count();
  s.body_steps_asleep += output.report.bodies_asleep;
  for (const Event& e : output.events) {
    ++s.events[to_string(e.kind)];
    if (e.kind != EventKind::cut_refused) continue;
    ++s.refusals[e.text];
    log_limited(LogLevel::warning, "cut refused", "cut refused: " + e.text);
  }
  s.least_margin = std::min(s.least_margin, output.report.stability_margin);
  s.largest_penetration_m = std::max(s.largest_penetration_m, output.report.penetration_m);
  s.largest_added_mass = std::max(s.largest_added_mass, output.report.added_mass_fraction);
  for (const ContactModel& c : output.contacts) s.largest_force_n = std::max(s.largest_force_n, c.force_world_n.norm());
}

void RunRecord::add_publish(double time_s) {
  state_->publish_times_s.push_back(static_cast<float>(time_s));
}

void RunRecord::set(const SyncCost& cost) {
  state_->cost = cost;
}

nlohmann::ordered_json RunRecord::State::body(const Simulation& simulation, std::uint32_t id) const {
  const TriangleMesh& mesh = simulation.mesh(id);
  const SurfaceReport rest = check(mesh);
  std::vector<Vec3> now;
  for (const Vec3f& x : simulation.positions_world_m(id)) now.push_back(x.cast<double>());
  nlohmann::ordered_json body;
  body["name"] = simulation.body(id).name;
  body["vertices"] = rest.vertices;
  body["triangles"] = rest.triangles;
  body["components"] = rest.components;
  body["euler_characteristic"] = rest.euler_characteristic;
  body["closed"] = rest.closed;
  body["manifold"] = rest.manifold;
  body["enclosed_volume_m3"] = check(mesh, now).volume_m3;
  body["rest_volume_m3"] = rest.volume_m3;
  if (const Regions& regions = simulation.body(id).regions; !regions.empty()) {
    const RegionVolumes volumes = simulation.region_volumes(id);
    for (std::size_t i = 0; i < regions.size(); ++i) body["region_volumes_m3"][regions[i].name] = volumes.region_m3[i];
    body["marked_volume_m3"] = volumes.marked_m3(regions);
  }
  body["copy_bytes"] = simulation.copy_bytes(id);
  body["revision"] = mesh.revision();
  body["topology_hash"] = hex(mesh.hash());
  if (id < last.checks.size()) {
    const BodyCheck& c = last.checks[id];
    if (c.error_estimate > 0 || c.cpu_estimate > 0) {
      body["check"]["model"] = simulation.body(id).model;
      body["check"]["error_estimate"] = c.error_estimate;
      body["check"]["cpu_estimate_s_per_s"] = c.cpu_estimate;
    }
    body["check"]["cpu_s_per_s"] = cpu_s[id] / std::max(1e-9, static_cast<double>(steps) * scene.step_s);
    body["check"]["stability_margin"] = c.stability_margin;
    body["check"]["largest_residual_m"] = residual_m[id];
    body["check"]["energy_gain_j"] = c.energy_gain_j;
    body["check"]["implicit_steps"] = c.implicit_steps;
  }
  if (const auto& notes = simulation.body(id).mesh_notes; !notes.empty()) body["mesh_notes"] = notes;
  return body;
}

nlohmann::ordered_json RunRecord::State::run() {
  nlohmann::ordered_json run;
  run["steps"] = steps;
  run["simulated_s"] = static_cast<double>(steps) * scene.step_s;
  run["cuts_made"] = last.cuts_made;
  run["cuts_refused"] = last.cuts_refused;
  run["edges_collapsed"] = last.edges_collapsed;
  run["removed_volume_m3"] = last.removed_volume_m3;
  run["asleep_fraction"] =
      static_cast<double>(body_steps_asleep) / static_cast<double>(std::max(body_steps, std::uint64_t{1}));
  run["contact_time_s"] = last.contact_time_s;
  run["step_time_median_s"] = quantile(step_times_s, 0.5);
  run["step_time_total_s"] = std::accumulate(step_times_s.begin(), step_times_s.end(), 0.0);
  run["processor_time_s"] = processor_time_s() - processor_begun_s;
  run["step_time_p99_s"] = quantile(step_times_s, 0.99);
  run["stability_margin"] = least_margin;
  run["added_mass_fraction"] = largest_added_mass;
  run["largest_force_n"] = largest_force_n;
  run["largest_penetration_m"] = largest_penetration_m;
  run["local_searches"] = last.local_searches;
  run["global_searches"] = last.global_searches;
  run["events"] = events;
  if (!refusals.empty()) run["refusals"] = refusals;
  return run;
}

nlohmann::ordered_json RunRecord::State::session() {
  nlohmann::ordered_json session;
  session["copy_bytes"] = cost->copy_bytes;
  session["publish_time_median_s"] = quantile(publish_times_s, 0.5);
  session["publish_time_p99_s"] = quantile(publish_times_s, 0.99);
  session["publish_time_total_s"] = std::accumulate(publish_times_s.begin(), publish_times_s.end(), 0.0);
  session["network_time_total_s"] = cost->network_total_s;
  session["waited_for_servers_s"] = cost->waited_for_servers_s;
  session["deferred_steps"] = cost->deferred_steps;
  session["reduced_steps"] = cost->reduced_steps;
  session["slowed_steps"] = cost->slowed_steps;
  session["most_behind_s"] = cost->most_behind_s;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  session["peak_memory_bytes"] = 1024 * static_cast<std::uint64_t>(usage.ru_maxrss);
  return session;
}

nlohmann::ordered_json RunRecord::State::exercise(const Score& score) {
  nlohmann::ordered_json exercise;
  exercise["body"] = score.body;
  exercise["marked_m3"] = score.marked_m3;
  exercise["marked_removed_m3"] = score.marked_removed_m3;
  exercise["marked_removed_fraction"] = score.marked_m3 > 0 ? score.marked_removed_m3 / score.marked_m3 : 0;
  exercise["marked_in_bin_m3"] = score.marked_in_bin_m3;
  exercise["in_bin"] = score.in_bin;
  exercise["healthy_lost_m3"] = score.healthy_lost_m3;
  exercise["time_s"] = score.time_s;
  exercise["largest_force_n"] = score.largest_force_n;
  exercise["removed"] = nlohmann::ordered_json::array();
  for (const TissuePiece& piece : score.removed)
    exercise["removed"].push_back({{"body", piece.body},
                                   {"marked_m3", piece.marked_m3},
                                   {"healthy_m3", piece.healthy_m3},
                                   {"in_bin", piece.in_bin}});
  for (const InstrumentUse& use : score.instruments)
    exercise["instruments"].push_back({{"name", use.name},
                                       {"path_m", use.path_m},
                                       {"largest_force_n", use.largest_force_n},
                                       {"contact_time_s", use.contact_time_s}});
  return exercise;
}

void RunRecord::State::write(const Simulation& simulation, const std::string& json) const {
  for (std::uint32_t i = 0; i < simulation.body_count(); ++i)
    write_obj(file_of(directory, simulation.body(i).name), simulation.mesh(i), simulation.positions_world_m(i));
  write_text(directory + "/report.json", json);
}

std::string RunRecord::finish(const Simulation& simulation) {
  State& s = *state_;
  nlohmann::ordered_json report;
  report["session"] = s.scene.session;
  report["scene"] = std::filesystem::path(s.scene.file).filename().string();
  for (std::uint32_t i = 0; i < simulation.body_count(); ++i) report["bodies"].push_back(s.body(simulation, i));
  report["run"] = s.run();
  if (s.score) {
    const Score score = s.score->finish();
    report["exercise"] = s.exercise(score);
    for (const std::string& line : to_lines(score)) log_info(line);
  }
  if (s.cost) report["session_cost"] = s.session();
  const std::string json = report.dump(2) + "\n";
  s.journal.reset();  // closes the file
  if (!s.directory.empty()) s.write(simulation, json);
  return json;
}

void Progress::show(const StepOutput& output) {
  const auto now = Clock::now();
  if (shown_ && now - *shown_ < std::chrono::seconds(1) && output.step != steps_) return;
  shown_ = now;
  char text[128];
  std::snprintf(text, sizeof text, "step %" PRIu64 " of %" PRIu64 ", %.2f s simulated, %" PRIu64 " cuts", output.step,
                steps_, output.sim_time_s, output.report.cuts_made);
  log_info(text);
}

std::uint64_t steps_of(const Scene& scene, std::uint64_t steps) {
  return steps > 0 ? steps : static_cast<std::uint64_t>(std::llround(scene.duration_s / scene.step_s));
}

std::vector<ToolSample> samples_of_traces(const Scene& scene, std::uint64_t step) {
  constexpr double kSamplePeriodS = 0.001;
  const auto index_at = [](double time_s) {
    return static_cast<std::uint64_t>(std::floor(time_s / kSamplePeriodS + 1e-9));
  };
  const std::uint64_t first = step == 1 ? 0 : index_at(static_cast<double>(step - 1) * scene.step_s) + 1;
  const std::uint64_t last = index_at(static_cast<double>(step) * scene.step_s);
  std::vector<ToolSample> samples;
  for (std::uint32_t tool = 0; tool < scene.tools.size(); ++tool) {
    if (scene.tools[tool].trace.empty()) continue;
    for (std::uint64_t i = first; i <= last; ++i) {
      const double time_s = static_cast<double>(i) * kSamplePeriodS;
      const TracePoint point = point_at(scene.tools[tool].trace, time_s);
      samples.push_back({tool, i + 1, time_s, point.pose_world, point.opening_rad});
    }
  }
  return samples;
}

void write_obj(const std::string& path, const TriangleMesh& mesh, std::span<const Vec3f> positions_world_m) {
  std::ofstream file(path);
  std::vector<std::uint32_t> number(mesh.vertex_slots(), 0);
  std::uint32_t next = 1;
  char line[96];
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    if (!mesh.vertex_alive(v)) continue;
    number[v] = next++;
    const Vec3f& x = positions_world_m[v];
    std::snprintf(line, sizeof line, "v %.9g %.9g %.9g\n", double(x[0]), double(x[1]), double(x[2]));
    file << line;
  }
  for (const Surface surface : {Surface::skin, Surface::wall}) {
    file << (surface == Surface::skin ? "g skin\n" : "g wall\n");
    for (const Triangle& t : mesh.triangles())
      if (t.alive() && t.surface == surface)
        file << "f " << number[t.v[0]] << ' ' << number[t.v[1]] << ' ' << number[t.v[2]] << '\n';
  }
  if (!file.flush()) throw InputError(path + ": can't be written");
}

std::string run_offline(const Scene& scene, std::uint64_t steps, const std::string& directory) {
  Simulation simulation(fill_volumes(scene));
  simulation.measure_with(processor_time_s);
  RunRecord record(scene, simulation, directory);
  Progress progress(steps_of(scene, steps));
  StepInput input;
  for (std::uint64_t k = 1; k <= steps_of(scene, steps); ++k) {
    input.samples = samples_of_traces(scene, k);
    const auto start = Clock::now();
    const StepOutput& output = simulation.step(input);
    record.add(output, seconds_since(start));
    progress.show(output);
  }
  return record.finish(simulation);
}

std::string measure_gaps(const Scene& scene) {
  Simulation simulation(fill_volumes(scene));
  std::vector<std::vector<ContactGap>> gaps(scene.bodies.size());
  StepInput input;
  for (std::uint64_t k = 1; k <= steps_of(scene, 0); ++k) {
    input.samples = samples_of_traces(scene, k);
    simulation.step(input);
    for (std::uint32_t b = 0; b < gaps.size(); ++b) gaps[b].push_back(simulation.contact_gap(b));
  }
  std::string text;
  for (std::size_t b = 0; b < gaps.size(); ++b) {
    double deepest_m = 0, most_m = 0, sum_m = 0;
    for (const ContactGap& g : gaps[b]) deepest_m = std::max(deepest_m, g.depth_m);
    std::uint64_t steps = 0;
    for (const ContactGap& g : gaps[b]) {
      if (g.depth_m < 0.9 * deepest_m || g.depth_m <= 0) continue;  // still on its way in, or out already
      most_m = std::max(most_m, g.gap_m);
      sum_m += g.gap_m;
      ++steps;
    }
    char line[256];
    std::snprintf(line, sizeof line,
                  "%s, contact by %s, pressed to %.1f mm: gap at most %.2f mm, in the mean %.2f mm (%" PRIu64
                  " steps)\n",
                  scene.bodies[b].name.c_str(), scene.bodies[b].contact.style.c_str(), 1e3 * deepest_m, 1e3 * most_m,
                  steps > 0 ? 1e3 * sum_m / static_cast<double>(steps) : 0, steps);
    text += line;
  }
  return text;
}

void replay(const std::string& journal, const std::string& export_directory) {
  if (!export_directory.empty()) make_directory(export_directory);
  for (const auto& [step, g] : read_gravity(journal)) {
    char text[128];
    std::snprintf(text, sizeof text, "gravity turned at step %" PRIu64 " to [%.3g, %.3g, %.3g] m/s2", step, g.x(),
                  g.y(), g.z());
    log_info(text);
  }
  for (const JournalBody& body : read_journal(journal)) {
    log_info(body.name + ": revision " + std::to_string(body.mesh.revision()) + ", topology hash " +
             hex(body.mesh.hash()));
    if (export_directory.empty()) continue;
    std::vector<Vec3f> rest;
    for (const Vec3& x : body.mesh.rest_body_m()) rest.push_back(x.cast<float>());
    write_obj(file_of(export_directory, body.name), body.mesh, rest);
  }
}

}  // namespace sectio

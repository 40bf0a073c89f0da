#include "sim_server/session/report.h"

#include <sys/resource.h>

#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/core/report_figures.h"
#include "common/mesh/check.h"

namespace sectio {
namespace {

using Json = nlohmann::ordered_json;

Json body_report(const RunFigures& f, const Scene& scene, const Simulation& simulation, std::uint32_t id) {
  const TriangleMesh& mesh = simulation.mesh(id);
  const SurfaceReport rest = check(mesh);
  std::vector<Vec3> now;
  for (const Vec3f& x : simulation.positions_world_m(id)) now.push_back(x.cast<double>());
  Json body;
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
  body["topology_hash"] = hash_text(mesh.hash());
  if (id < f.last.checks.size()) {
    const BodyCheck& c = f.last.checks[id];
    if (c.error_estimate > 0 || c.cpu_estimate > 0) {
      body["check"]["model"] = simulation.body(id).model;
      body["check"]["error_estimate"] = c.error_estimate;
      body["check"]["cpu_estimate_s_per_s"] = c.cpu_estimate;
    }
    if (id < scene.bodies.size() && scene.bodies[id].plan.cut_cpu_estimate) {
      body["check"]["cpu_while_cut_estimate_s_per_s"] = *scene.bodies[id].plan.cut_cpu_estimate;
      body["check"]["cut_step_estimate_s"] = *scene.bodies[id].plan.cut_step_estimate_s;
    }
    if (const CutCost& cuts = f.body_cuts[id]; cuts.steps > 0) {
      body["check"]["cpu_while_cut_s_per_s"] = cuts.while_s / (static_cast<double>(cuts.within) * scene.step_s);
      body["check"]["cut_step_s"] = cuts.time_s / static_cast<double>(cuts.steps);
    }
    body["check"]["cpu_s_per_s"] = f.body_cpu_s[id] / std::max(1e-9, static_cast<double>(f.steps) * scene.step_s);
    body["check"]["stability_margin"] = c.stability_margin;
    body["check"]["largest_residual_m"] = f.body_residual_m[id];
    body["check"]["energy_gain_j"] = c.energy_gain_j;
    body["check"]["implicit_steps"] = c.implicit_steps;
    body["check"]["steps_not_met"] = f.last.drivers[id].steps_not_met;
    body["check"]["largest_residual"] = f.body_residual[id];
    body["check"]["largest_speed_m_per_s"] = f.last.drivers[id].largest_speed_m_per_s;
    body["check"]["added_mass_fraction"] = f.body_added_mass[id];
  }
  if (const auto& notes = simulation.body(id).mesh_notes; !notes.empty()) body["mesh_notes"] = notes;
  return body;
}

Json run_report(const RunFigures& f, const Scene& scene) {
  Json run;
  run["steps"] = f.steps;
  run["simulated_s"] = static_cast<double>(f.steps) * scene.step_s;
  run["cuts_made"] = f.last.cuts_made;
  run["cuts_refused"] = f.last.cuts_refused;
  run["edges_collapsed"] = f.last.edges_collapsed;
  run["removed_volume_m3"] = f.last.removed_volume_m3;
  run["asleep_fraction"] =
      static_cast<double>(f.body_steps_asleep) / static_cast<double>(std::max(f.body_steps, std::uint64_t{1}));
  run["contact_time_s"] = f.last.contact_time_s;
  run["step_time_median_s"] = f.step_times.quantile(0.5);
  run["step_time_total_s"] = f.step_times.total_s();
  run["processor_time_s"] = f.processor_s;
  run["step_time_p99_s"] = f.step_times.quantile(0.99);
  run["stability_margin"] = f.least_margin;
  run["added_mass_fraction"] = f.largest_added_mass;
  run["largest_force_n"] = f.largest_force_n;
  run["largest_penetration_m"] = f.largest_penetration_m;
  run["local_searches"] = f.last.local_searches;
  run["global_searches"] = f.last.global_searches;
  run["events"] = f.events;
  if (!f.refusals.empty()) run["refusals"] = f.refusals;
  if (!f.warnings.empty()) run["warnings"] = f.warnings;
  return run;
}

Json stroke_report(const StrokeEntry& stroke, const Scene& scene, const Simulation& simulation) {
  Json entry;
  entry["tool"] = scene.tools.at(stroke.tool_id).name;
  entry["body"] = simulation.body(stroke.body_id).name;
  const auto at_s = [&](std::uint64_t step) {
    return std::round(1e6 * static_cast<double>(step) * scene.step_s) / 1e6;
  };
  entry["from_s"] = at_s(stroke.from_step);
  if (stroke.to_step > 0) entry["to_s"] = at_s(stroke.to_step);
  entry["end"] = stroke.end;
  return entry;
}

Json session_report(const RunFigures& f) {
  Json session;
  session["copy_bytes"] = f.cost->copy_bytes;
  session["publish_time_median_s"] = f.publish_times.quantile(0.5);
  session["publish_time_p99_s"] = f.publish_times.quantile(0.99);
  session["publish_time_total_s"] = f.publish_times.total_s();
  session["network_time_total_s"] = f.cost->network_total_s;
  session["waited_for_servers_s"] = f.cost->waited_for_servers_s;
  session["deferred_steps"] = f.cost->deferred_steps;
  session["reduced_steps"] = f.cost->reduced_steps;
  session["slowed_steps"] = f.cost->slowed_steps;
  session["most_behind_s"] = f.cost->most_behind_s;
  session["orders_refused"] = f.cost->orders_refused;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  session["peak_memory_bytes"] = 1024 * static_cast<std::uint64_t>(usage.ru_maxrss);
  return session;
}

Json exercise_report(const Score& score) {
  Json exercise;
  exercise["body"] = score.body;
  exercise["marked_m3"] = score.marked_m3;
  exercise["marked_removed_m3"] = score.marked_removed_m3;
  exercise["marked_removed_fraction"] = score.marked_m3 > 0 ? score.marked_removed_m3 / score.marked_m3 : 0;
  exercise["marked_in_bin_m3"] = score.marked_in_bin_m3;
  exercise["in_bin"] = score.in_bin;
  exercise["healthy_lost_m3"] = score.healthy_lost_m3;
  if (score.spared_touches) exercise["spared_touches"] = *score.spared_touches;
  if (score.line) {
    exercise["line"] = {{"length_m", score.line->length_m},       {"cut_fraction", score.line->cut_fraction},
                        {"deviation_m", score.line->deviation_m}, {"most_deviation_m", score.line->most_deviation_m},
                        {"depth_m", score.line->depth_m},         {"astray_m", score.line->astray_m},
                        {"tremor_m", score.line->tremor_m}};
    for (const auto& beside_m : score.line->beside_m)
      exercise["line"]["beside_m"].push_back(beside_m ? Json(*beside_m) : Json());
  }
  exercise["time_s"] = score.time_s;
  exercise["largest_force_n"] = score.largest_force_n;
  exercise["removed"] = Json::array();
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

Json outcome_report(const Outcome& outcome, const Scene& scene) {
  Json numbers;
  for (const Measure& measure : measures())
    if (scene.exercise || measure.of == MeasureOf::run) numbers[measure.key] = outcome.*measure.value;
  return numbers;
}

}  // namespace

void CutCost::add(std::uint64_t step, bool changed, double took_s, std::uint64_t longest_pause) {
  since_s += took_s;
  if (!changed) return;
  const bool goes_on = steps > 0 && step - last_step <= longest_pause;
  while_s += goes_on ? since_s : took_s;
  within += goes_on ? step - last_step : 1;
  time_s += took_s;
  ++steps;
  since_s = 0;
  last_step = step;
}

std::string report_text(const RunFigures& figures, const Scene& scene, const Simulation& simulation,
                        std::span<const std::string> reasons) {
  Json report;
  report["session"] = scene.session;
  report["scene"] = std::filesystem::path(scene.file).filename().string();
  report["ok"] = reasons.empty();
  report["reasons"] = reasons;
  for (std::uint32_t i = 0; i < simulation.body_count(); ++i)
    report["bodies"].push_back(body_report(figures, scene, simulation, i));
  report["outcome"] = outcome_report(figures.outcome, scene);
  for (const Expectation& e : scene.expect) report["expected"][e.measure->key] = e.range.in_words();
  report["run"] = run_report(figures, scene);
  for (const StrokeEntry& stroke : figures.strokes.strokes())
    report["strokes"].push_back(stroke_report(stroke, scene, simulation));
  if (figures.score) report["exercise"] = exercise_report(*figures.score);
  if (figures.cost) report["session_cost"] = session_report(figures);
  return report.dump(2) + "\n";
}

}  // namespace sectio

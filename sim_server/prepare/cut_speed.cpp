#include "sim_server/prepare/cut_speed.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/core/processor_time.h"
#include "sim_server/planning/resolution.h"
#include "sim_server/prepare/calibration_block.h"
#include "sim_server/simulation.h"

namespace sectio {
namespace {

using planning::CutRate;
using planning::Method;
using planning::Rate;

constexpr double kTissue_pa = 5000, kWay_m = 0.025, kSpeed_m_per_s = 0.2, kTop_m = 0.04;
constexpr double kShallow_m = 0.01, kDeep_m = 0.025;
const double kCoarse = planning::tetrahedra_for(kBlockVolume_m3, kBlockCell_m), kFine = 4 * kCoarse;
constexpr double kCells = kBlockVolume_m3 / (kBlockCell_m * kBlockCell_m * kBlockCell_m);
constexpr double kBegin_s = 0.03, kEnd_s = 0.04;  // before the blade comes, and after it has gone

// The steps of one stroke.
struct CutSteps {
  double edge_m = 0, tetrahedra = 0, depth_m = 0;
  double changes = 0, change_s = 0;  // how often the topology changes, and what a step costs more for it
  double more_s = 0;                 // a step afterwards, over one before

  double squares() const { return kWay_m * depth_m / (edge_m * edge_m); }
};

// Without the dearest tenth, which other programs have disturbed.
double mean(std::vector<double> times) {
  if (times.empty()) return 0;
  std::sort(times.begin(), times.end());
  times.resize(std::max<std::size_t>(1, times.size() * 9 / 10));
  double sum = 0;
  for (const double t : times) sum += t;
  return sum / static_cast<double>(times.size());
}

// A blade that goes in, along the block, and out.
ToolSpec blade(double depth_m) {
  ToolSpec tool;
  tool.name = tool.kind = "scalpel";
  tool.geometry.b_tool_m = Vec3(0, 0, 0.06);
  tool.geometry.c_tool_m = Vec3(0.004, 0, 0.045);
  tool.geometry.d_tool_m = Vec3(0.004, 0, 0.06);
  double time_s = 0;
  const auto go = [&](double x_m, double z_m, double takes_s) {
    time_s += takes_s;
    tool.trace.push_back({time_s, {Vec3(x_m, 0.0307, z_m), Eigen::Quaterniond::Identity()}, 0});
  };
  constexpr double kFrom_m = 0.0123, kAbove_m = 0.002;
  go(kFrom_m, kTop_m + kAbove_m, 0);
  go(kFrom_m, kTop_m + kAbove_m, kBegin_s);
  go(kFrom_m, kTop_m - depth_m, (kAbove_m + depth_m) / kSpeed_m_per_s);
  go(kFrom_m + kWay_m, kTop_m - depth_m, kWay_m / kSpeed_m_per_s);
  go(kFrom_m + kWay_m, kTop_m + kAbove_m, 0.02);
  go(kFrom_m + kWay_m, kTop_m + 0.05, 0.02);
  return tool;
}

CutSteps cut(Scene scene, double depth_m, double edge_m, double tetrahedra, const EngineTable& engines) {
  scene.step_s = 1e-3;
  scene.sleep.after_s = 0;
  scene.gravity_m_per_s2.setZero();
  scene.tools = {blade(depth_m)};
  BodySpec& body = scene.bodies[0];
  body.material.young_pa = kTissue_pa;
  body.material.toughness_j_per_m2 = 50;
  body.cutting.threshold_force_n = 0.02;
  Simulation simulation(scene, engines);
  simulation.measure_with(processor_time_s);
  const auto& trace = scene.tools[0].trace;
  const double along_from_s = trace[2].time_s, along_to_s = trace[3].time_s, out_s = trace.back().time_s;
  std::vector<double> before, with_change, without, after;
  double so_far_s = 0;
  for (std::uint64_t step = 1; static_cast<double>(step) * scene.step_s < out_s + kEnd_s; ++step) {
    const double time_s = static_cast<double>(step) * scene.step_s;
    StepInput input;
    input.samples = {{0, step, time_s, pose_at(trace, time_s), 0}};
    const StepOutput& output = simulation.step(input);
    const double took_s = output.report.processor_s[0] - so_far_s;
    so_far_s += took_s;
    if (time_s < kBegin_s) before.push_back(took_s);
    if (time_s > along_from_s && time_s < along_to_s) (output.deltas.empty() ? without : with_change).push_back(took_s);
    if (time_s > out_s) after.push_back(took_s);
  }
  const double otherwise_s = without.size() > 3 ? mean(without) : mean(after);
  return {edge_m,
          tetrahedra,
          depth_m,
          static_cast<double>(with_change.size()),
          std::max(0.0, mean(with_change) - otherwise_s),
          std::max(0.0, mean(after) - mean(before))};
}

}  // namespace

CutSpeed::CutSpeed(const EngineTable& engines)
    : engines_(engines), coarse_(filled_block(kCoarse)), fine_(filled_block(kFine)) {}

CutRate CutSpeed::of(const Method& method, const Rate& rate) const {
  CutRate cuts;
  const auto note = [&](const CutSteps& steps) {
    cuts.changes_per_edge = steps.changes * steps.edge_m / kWay_m;
    cuts.open_ns = 1e9 * steps.more_s / steps.squares();
  };
  if (!method.needs_volume()) {
    const CutSteps steps = cut(surface_block(), kShallow_m, kSurfaceEdge_m, 0, engines_);
    note(steps);
    cuts.change_ns = 1e9 * steps.change_s;
    return cuts;
  }
  Method with_explicit = method;
  with_explicit.is_implicit = false;
  const auto go = [&](const Scene& block, double tetrahedra, double depth_m, double cell_m = kBlockCell_m) {
    return cut(with_model(block, with_explicit, kTissue_pa, cell_m), depth_m,
               planning::cube_for(kBlockVolume_m3, tetrahedra), tetrahedra, engines_);
  };
  const CutSteps shallow = go(coarse_, kCoarse, kShallow_m), deep = go(coarse_, kCoarse, kDeep_m),
                 fine = go(fine_, kFine, kShallow_m);
  note(fine);
  const auto in_edges = [](const CutSteps& s) { return s.depth_m / s.edge_m; };
  const auto more_ns = [](const CutSteps& than, const CutSteps& s) { return 1e9 * (s.change_s - than.change_s); };
  cuts.deep_ns = std::max(0.0, more_ns(shallow, deep)) / (in_edges(deep) - in_edges(shallow));
  const double same_ns = cuts.deep_ns * (in_edges(fine) - in_edges(shallow));
  cuts.whole_ns = std::max(0.0, more_ns(shallow, fine) - same_ns) / (kFine - kCoarse);
  if (method.embeds()) {
    const CutSteps small_cells = go(coarse_, kCoarse, kShallow_m, kBlockCell_m / 2);
    cuts.cell_ns = std::max(0.0, more_ns(shallow, small_cells)) / (7 * kCells);
  } else {
    cuts.open_ns = std::max(0.0, cuts.open_ns - planning::kMorePerSquare * rate.element_ns);
  }
  const double known_ns = cuts.deep_ns * in_edges(shallow) + cuts.whole_ns * kCoarse + cuts.cell_ns * kCells;
  cuts.change_ns = std::max(0.0, 1e9 * shallow.change_s - known_ns);
  return cuts;
}

}  // namespace sectio

#include <algorithm>

#include "common/core/formatted.h"
#include "sim_server/planning/plan.h"

namespace sectio::planning {
namespace {

std::string line_of(const BodyLoad& load) {
  const LoadCase& l = load.what;
  const char* along = l.load == Load::indentation ? "contact" : l.load == Load::opening ? "cut" : "thickness";
  std::string line =
      formatted("  %-12s %-17s %s %.3g mm", to_string(l.load), load.from.c_str(), along, 1e3 * l.width_m);
  if (load.is_weight && l.share < 1)
    line += formatted(", moves it by %.2g of its thickness", kSagThatMatters * l.share);
  if (l.load == Load::opening) line += formatted(", %.0f %% of the tissue there", 100 * load.depth_of_tissue);
  return line + "\n";
}

std::string line_of(const Candidate& c, const Budgets& budgets, bool chosen) {
  std::string line = formatted("%c %-21s", chosen ? '>' : ' ', c.method->name.c_str());
  line += formatted(" %6.3g mm %8.0f  %5.3g ms / %-3d %8.3g %s %8.3g %s", 1e3 * c.cell_m, c.elements, 1e3 * c.step_s,
                    c.substeps, c.error, c.error <= budgets.error ? " " : "!", c.cpu, c.cpu <= budgets.cpu ? " " : "!");
  if (c.cut_cpu > 0) line += formatted("%8.3g %s", c.cut_cpu, c.cut_cpu <= budgets.cpu ? " " : "!");
  line += c.error > 0 ? formatted(" %s", to_string(c.worst)) : std::string(" no load");
  return line + (c.unfit.empty() ? "" : ", " + c.unfit) + "\n";
}

std::string line_of(const Stroke& stroke) {
  return formatted("  %-12s %-17s %.3g mm in %.3g s, %.3g mm deep%s\n", "cutting", stroke.from.c_str(),
                   1e3 * stroke.way_m, stroke.time_s, 1e3 * stroke.depth_m(), stroke.goes_through ? ", through" : "");
}

// The cost of cuts with the model that was taken.
std::string line_of_cuts(const PlanInput& in, const Candidate& c) {
  if (c.cut_cpu == 0) return {};
  return formatted("a step that cuts: %.2g ms; while it is cut: cost %.3g%s; afterwards %.0f elements\n",
                   1e3 * c.cut_step_s, c.cut_cpu, c.cut_cpu > in.budgets.cpu ? ", over the budget" : "",
                   c.elements_after_cut);
}

std::string verdict(const PlanInput& in, const BodyPlan& plan) {
  const Candidate& c = plan.chosen;
  if (plan.fits)
    return formatted("taken: %s, %s model that keeps error %.3g and cost %.3g\n", c.method->name.c_str(),
                     c.method->needs_volume() ? "the cheapest" : "the simplest", in.budgets.error, in.budgets.cpu);
  return formatted(
      "no model keeps error %.3g and cost %.3g; taken: %s, the nearest, which needs error_budget %.2g and cpu_budget "
      "%.2g\n",
      in.budgets.error, in.budgets.cpu, c.method->name.c_str(), std::max(c.error, in.budgets.error),
      std::max(c.most_cpu(), in.budgets.cpu));
}

}  // namespace

std::string to_text(const PlanInput& in, const BodyPlan& plan) {
  std::string out = formatted("%s: %.3g mm thick, %.3g ml, %s\n", in.body.c_str(), 1e3 * in.shape.thickness_m,
                              1e6 * in.shape.volume_m3, in.shape.is_box ? "a box" : "no box");
  for (const BodyLoad& load : in.loads) out += line_of(load);
  for (const Stroke& stroke : in.strokes) out += line_of(stroke);
  if (in.loads.empty()) out += "  no load of significance\n";
  out += formatted("  %-21s %9s %8s  %15s %-8s   %-8s%s\n", "", "cell", "elements", "step / substeps", "   error",
                   "    cost", in.strokes.empty() ? "" : "   cutting");
  for (const Candidate& c : plan.considered)
    out += line_of(c, in.budgets, c.method == plan.chosen.method && c.cell_m == plan.chosen.cell_m);
  for (const auto& [method, why] : plan.ruled_out) out += formatted("  %-21s %s\n", method->name.c_str(), why.c_str());
  return out + verdict(in, plan) + line_of_cuts(in, plan.chosen);
}

}  // namespace sectio::planning

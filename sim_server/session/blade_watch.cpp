#include "sim_server/session/blade_watch.h"

#include <algorithm>

#include "common/core/formatted.h"

namespace sectio {
namespace {

bool has_edge(const ToolSpec& tool) {
  const InstrumentShape shape = instrument_of(tool.kind).shape(tool.geometry, {tool.intensity, 0, 0});
  return (shape.edge_tip_tool_m - shape.edge_heel_tool_m).norm() > 0;
}

}  // namespace

BladeWatch::BladeWatch(const Scene& scene) : scene_(scene) {
  for (const ToolSpec& tool : scene.tools) blades_.emplace_back().watched = has_edge(tool);
}

std::string BladeWatch::warning(std::uint32_t tool) const {
  return "tool " + scene_.tools[tool].name +
         formatted(" has touched tissue for %.2g s without cutting: ", blades_[tool].contact_time_s) +
         reason(tool, blades_[tool]);
}

std::string BladeWatch::reason(std::uint32_t tool, const Blade& blade) const {
  if (!blade.refusal.empty()) return "every cut was refused: " + blade.refusal;
  if (!blade.remark.empty()) return blade.remark;
  const InstrumentKind& kind = instrument_of(scene_.tools[tool].kind);
  if (kind.only_closing) return "its jaws never closed on tissue";
  if (kind.edge_enters) return "its edge never reached into the tissue on the way of its sharp side";
  if (blade.body_id < scene_.bodies.size()) {
    const BodySpec& body = scene_.bodies[blade.body_id];
    const auto force = body.cutting.threshold_force_n, displacement = body.cutting.threshold_displacement_m;
    if (force && blade.largest_force_n < *force)
      return formatted("it pushed with %.3g N at most, and threshold_force_n is %.3g N in ", blade.largest_force_n,
                       *force) +
             body.name;
    if (displacement)
      return formatted("threshold_displacement_m, %.3g mm, was not reached (%.3g N at most) in ", 1e3 * *displacement,
                       blade.largest_force_n) +
             body.name;
  }
  return "its edge never crossed the surface";
}

std::vector<std::string> BladeWatch::add(const StepOutput& output) {
  for (const Event& event : output.events) {
    if (event.tool_id >= blades_.size()) continue;
    Blade& blade = blades_[event.tool_id];
    if (event.kind == EventKind::penetrated) blade.watched = false;
    if (event.kind == EventKind::contact_began) blade.body_id = event.body_id;
    if (event.kind == EventKind::cut_refused) blade.refusal = event.text;
    if (event.kind == EventKind::did_not_cut) blade.remark = event.text;
  }
  std::vector<std::string> warnings;
  for (const ContactModel& contact : output.contacts) {
    if (contact.state == ContactState::free || contact.tool_id >= blades_.size()) continue;
    Blade& blade = blades_[contact.tool_id];
    blade.contact_time_s += scene_.step_s;
    blade.smooth_force_n += share_of_push(scene_.step_s) * (contact.force_world_n.norm() - blade.smooth_force_n);
    blade.largest_force_n = std::max(blade.largest_force_n, blade.smooth_force_n);
    if (!blade.watched || blade.contact_time_s < kPatience_s) continue;
    blade.watched = false;
    warnings.push_back(warning(contact.tool_id));
  }
  return warnings;
}

std::vector<std::string> BladeWatch::finish() const {
  std::vector<std::string> warnings;
  for (std::uint32_t tool = 0; tool < blades_.size(); ++tool)
    if (blades_[tool].watched && blades_[tool].contact_time_s >= kTouch_s) warnings.push_back(warning(tool));
  return warnings;
}

}  // namespace sectio

#include "sim_server/session/stroke_log.h"

#include <algorithm>
#include <ranges>

namespace sectio {

void StrokeLog::add(const Event& event) {
  if (event.kind == EventKind::penetrated && strokes_.size() < kMost) {
    StrokeEntry& stroke = strokes_.emplace_back();
    stroke.tool_id = event.tool_id;
    stroke.body_id = event.body_id;
    stroke.from_step = event.step;
  }
  const bool ends = event.kind == EventKind::cut_ended, joins = event.kind == EventKind::joined;
  if (!ends && !joins && event.kind != EventKind::cut_refused) return;
  auto latest_first = std::views::reverse(strokes_);
  const auto stroke = std::ranges::find_if(latest_first, [&](const StrokeEntry& s) {
    return s.tool_id == event.tool_id && s.body_id == event.body_id && !s.is_over;
  });
  if (stroke == latest_first.end()) return;
  stroke->to_step = event.step;
  stroke->is_over = ends;
  if (joins || !event.text.empty()) stroke->end = joins ? "it ran into a cut" : event.text;
}

}  // namespace sectio

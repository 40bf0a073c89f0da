#include "sim_server/session/stroke_log.h"

#include <algorithm>
#include <ranges>

namespace sectio {

void StrokeLog::add(const Event& event) {
  if (event.kind == EventKind::penetrated && strokes_.size() < kMost)
    strokes_.push_back({event.tool_id, event.body_id, event.step, 0, {}});
  const bool ends = event.kind == EventKind::cut_ended, joins = event.kind == EventKind::joined;
  if (!ends && !joins && event.kind != EventKind::cut_refused) return;
  auto latest_first = std::views::reverse(strokes_);
  const auto stroke = std::ranges::find_if(
      latest_first, [&](const StrokeEntry& s) { return s.tool_id == event.tool_id && s.body_id == event.body_id; });
  if (stroke == latest_first.end() || stroke->to_step > 0) return;
  // A refusal, or a way into another cut, may end a stroke or not: what comes after it tells.
  if (joins || !event.text.empty()) stroke->end = joins ? "it ran into a cut" : event.text;
  if (ends) stroke->to_step = event.step;
}

}  // namespace sectio

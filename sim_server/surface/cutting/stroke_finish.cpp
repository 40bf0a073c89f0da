#include "sim_server/surface/cutting/stroke.h"

namespace sectio {

bool keep_what_is_open(Stroke& stroke, GrooveDraft& grooves) {
  const VertexId apex = stroke.cell.apex;
  if (stroke.temporary_inverse) {
    stroke.temporary_inverse.reset();
    if (stroke.bottom == kNone)
      grooves.set_end(stroke.start != kNone ? stroke.start : apex, stroke.temporary_bottoms[0]);
    grooves.set_end(stroke.temporary_tip, stroke.temporary_bottoms.back());
    for (const VertexId g : stroke.temporary_bottoms) grooves.add_bottom(g);
    return true;
  }
  if (stroke.bottom != kNone) grooves.set_end(apex, stroke.bottom);
  return stroke.bottom != kNone;
}

bool finish(MeshDraft& draft, Stroke& stroke, GrooveDraft& grooves) {
  if (keep_what_is_open(stroke, grooves)) return true;
  const VertexId apex = stroke.cell.apex;
  if (stroke.start == kNone) return true;  // touched, not cut

  // The cut is scored along one edge only, so the middle of the edge becomes the pair that an opening needs.
  const VertexId middle =
      insert_on_edge(draft, stroke.start, apex, VertexState::mix(draft.state(stroke.start), draft.state(apex), 0.5));
  if (middle == kNone) return false;
  const VertexState middle_bottom = VertexState::mix(*stroke.start_bottom, *stroke.apex_bottom, 0.5);
  const auto opening =
      open_start(draft, stroke.start, middle, apex, {*stroke.start_bottom, middle_bottom, *stroke.apex_bottom});
  if (!opening) return false;
  grooves.set_end(stroke.start, opening->bottom[0]);
  grooves.set_end(apex, opening->bottom[2]);
  for (const VertexId g : opening->bottom) grooves.add_bottom(g);
  return true;
}

}  // namespace sectio

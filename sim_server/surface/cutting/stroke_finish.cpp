#include "sim_server/surface/cutting/stroke.h"

namespace sectio {

void add_temporary(const Stroke& stroke, Grooves& grooves) {
  if (!stroke.temporary_inverse) return;
  if (stroke.bottom == kNone) {  // it opened this cut, which runs from its start through a middle to the tip
    const VertexId start = stroke.start != kNone ? stroke.start : stroke.cell.apex;
    grooves.ends[start] = stroke.temporary_bottoms[0];
    grooves.set_bottom(start, stroke.temporary_bottoms[0]);
  }
  const VertexId beneath = stroke.bottom == kNone ? stroke.temporary_bottoms[1] : stroke.bottom;
  for (const VertexId v : stroke.temporary_pair) grooves.set_bottom(v, beneath);
  grooves.ends[stroke.temporary_tip] = stroke.temporary_bottoms.back();
  grooves.set_bottom(stroke.temporary_tip, stroke.temporary_bottoms.back());
}

bool keep_what_is_open(Stroke& stroke, Grooves& grooves) {
  if (stroke.temporary_inverse) {
    add_temporary(stroke, grooves);
    stroke.temporary_inverse.reset();
    return true;
  }
  if (stroke.bottom != kNone) grooves.ends[stroke.cell.apex] = stroke.bottom;
  return stroke.bottom != kNone;
}

bool finish(MeshDraft& draft, Stroke& stroke, Grooves& grooves) {
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
  grooves.ends[stroke.start] = opening->bottom[0];
  grooves.ends[apex] = opening->bottom[2];
  grooves.set_bottom(stroke.start, opening->bottom[0]);
  grooves.set_bottom(middle, opening->bottom[1]);
  grooves.set_bottom(opening->twin, opening->bottom[1]);
  grooves.set_bottom(apex, opening->bottom[2]);
  return true;
}

}  // namespace sectio

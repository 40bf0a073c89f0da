// Plans a step's cuts with templates in one surface (paper A): a pure function, as plan_cut() is. The opening has a
// width, and goes through the body if the blade does (template_cut.h).
#pragma once

#include <span>
#include <vector>

#include "sim_server/surface/cutting/cut_plan.h"
#include "sim_server/surface/cutting/cuts_of.h"
#include "sim_server/surface/cutting/template_stroke.h"

namespace sectio {

using TemplateCuts = CutsOf<TemplateStroke>;
struct TemplateCutPlan : CutPlan {
  TemplateCuts after;
};

// Undoes every temporary part, begins a stroke for each entry, advances all strokes in order, and opens those that go
// on up to their blades, temporarily. A stroke that is refused ends and keeps its opening; the others go on.
TemplateCutPlan plan_template_cut(const TriangleMesh& mesh, ParticleView particles, const TemplateCuts& cuts,
                                  std::span<const Entry> entries, std::span<const BladeMotion> motions,
                                  const TemplateSettings& settings);

// Ends all strokes without a change of the mesh: what is open stays open.
void end_where_they_are(TemplateCuts& cuts);

}  // namespace sectio

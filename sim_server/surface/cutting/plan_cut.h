// Plans a step's progressive cuts in one surface (paper B): a pure function from the mesh, the state, the cuts that
// there are and the instruments' motion to a delta and the cuts afterwards.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "sim_server/surface/cutting/cut_plan.h"
#include "sim_server/surface/cutting/cuts_of.h"
#include "sim_server/surface/cutting/stroke.h"

namespace sectio {

using SurfaceCuts = CutsOf<Stroke>;
struct SurfaceCutPlan : CutPlan {
  SurfaceCuts after;
};

// Undoes every temporary subdivision, begins a stroke for each entry, advances all strokes in order, and opens those
// that go on up to their blades, temporarily. A stroke that can't follow its blade stays where it is, the others go
// on; it tries again in the next step, from where the blade then is. When it owes too much it is refused: its opening
// stays, and its blade begins anew.
SurfaceCutPlan plan_cut(const TriangleMesh& mesh, ParticleView particles, const SurfaceCuts& cuts,
                        std::span<const Entry> entries, std::span<const BladeMotion> motions,
                        const StrokeSettings& settings, bool loops_free_islands);

std::optional<InOpenCut> in_open_cut(const TriangleMesh& mesh, ParticleView particles, const SurfaceCuts& cuts,
                                     const Blade& blade);

// Ends all strokes without a change of the mesh: what is open stays open.
void end_where_they_are(SurfaceCuts& cuts);

}  // namespace sectio

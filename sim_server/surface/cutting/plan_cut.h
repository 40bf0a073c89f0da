// Plans a step's cuts in one body: a pure function from the mesh, the state and the instruments' motion to a delta.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sim_server/surface/cutting/islands.h"
#include "sim_server/surface/cutting/stroke.h"
#include "sim_server/surface/cutting/template_stroke.h"

namespace sectio {

// The motion of one instrument in this body in this step.
struct BladeMotion {
  std::uint32_t edge_id = 0;
  std::vector<Blade> path;  // poses since the last step in order; empty: the instrument stays where it was
  bool lift = false;        // the cut ends here, whatever the path
  // The triangles that the blade sweeps over, or that the poses of its line cross, as the collision engine found them.
  std::vector<TriangleId> active = {};
  Pose frame_world = {};  // for cutting with templates: the pose of the body's rest shape
};

// Null when the instrument does nothing here.
const BladeMotion* motion_of(std::span<const BladeMotion> motions, std::uint32_t edge_id);

// The point at which an instrument breaks the surface, as the collision engine found it.
struct Entry {
  std::uint32_t edge_id = 0;
  TriangleId triangle = kNone;
  Vec3 bary = Vec3::Constant(1.0 / 3);
};

// The cuts of one body. Only accept() changes them.
struct BodyCuts {
  Grooves grooves;
  std::vector<Stroke> strokes;                   // one for each instrument in the tissue, in either style
  std::vector<TemplateStroke> template_strokes;  // the same strokes, if they cut with templates

  const Stroke* stroke_of(std::uint32_t edge_id) const;
};

inline constexpr std::string_view kChangedBeneath = "the surface has changed under the cut";

// The end of a stroke's part of a plan. The stroke goes on if the plan still has it.
struct StrokeOutcome {
  std::uint32_t edge_id = 0;
  StrokeEnd end = StrokeEnd::going;
  std::string_view why = {};  // reason of a refusal, for a person
};

// Goes with a plan from the engine that made it, and back to that engine when the plan has been accepted: what the
// engine goes on with then. Nobody else knows what is in it.
struct CutTicket {
  virtual ~CutTicket() = default;
};

struct CutPlan {
  explicit CutPlan(const BodyCuts& cuts) : grooves(cuts.grooves) {}  // an empty plan

  TopologyDelta delta;                                  // empty(): the topology doesn't change
  std::vector<std::pair<VertexId, VertexState>> seeds;  // state to set once the delta is applied
  std::vector<StrokeOutcome> outcomes;
  std::vector<Island> islands;
  std::vector<Stroke> strokes;  // that go on
  std::vector<TemplateStroke> template_strokes;
  std::uint32_t refused = 0;  // cuts for which there was no valid subdivision
  Grooves grooves;
  std::shared_ptr<const CutTicket> ticket;  // of an engine that goes on with more than this
};

// Undoes every temporary subdivision, begins a stroke for each entry, advances all strokes in order, and opens those
// that go on up to their blades, temporarily. A stroke that can't follow its blade stays where it is, the others go
// on; it tries again in the next step, from where the blade then is. When it owes too much it is refused: its opening
// stays, and its blade begins anew.
CutPlan plan_cut(const TriangleMesh& mesh, ParticleView particles, const BodyCuts& cuts, std::span<const Entry> entries,
                 std::span<const BladeMotion> motions, const StrokeSettings& settings, bool loops_free_islands);

// A place between the lips of an open cut.
struct InOpenCut {
  Vec3 point_world_m = Vec3::Zero();  // where the line of a blade enters the lid over the groove
  TriangleId beside = kNone;          // skin at a lip
};
std::optional<InOpenCut> in_open_cut(const TriangleMesh& mesh, ParticleView particles, const BodyCuts& cuts,
                                     const Blade& blade);

// plan_cut() with templates (paper A); plan_cut() calls it when the settings ask for it. A stroke that is refused ends
// and keeps its opening; the others go on. CutPlan::strokes shows a stroke of this style as one that only touches, with
// the place of the instrument in `touched` and `bary`.
CutPlan plan_with_templates(const TriangleMesh& mesh, ParticleView particles, const BodyCuts& cuts,
                            std::span<const Entry> entries, std::span<const BladeMotion> motions,
                            const StrokeSettings& settings);

// Applies the plan's delta and adopts its strokes. False when the delta can't be applied: the mesh is as before, and
// the strokes end where they are.
bool accept(const CutPlan& plan, TriangleMesh& mesh, BodyCuts& cuts);

}  // namespace sectio

// Cuts with templates (paper A, section 2.3) on a draft, as template_table.h describes.
//
// A knife cut is a sequence of smaller ones (template_stroke.h). One step cuts from one pose of the blade to the next,
// and hands the front, at which the blade stands, and the bottoms that follow the blade to the step after it.
//
//   first step                       next step goes on from the front (T, G): both become pairs, the old bottom face
//                                    (b- b+ G) is discarded, its sides adjusted
//    P----e----T  <- front             P----e----T----f----U  <- front
//    |    |    |                       |    |    |    |    |
//    g----b----G                       g----b----G----b----H
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "sim_server/surface/cutting/sweep_path.h"
#include "sim_server/surface/cutting/template_table.h"

namespace sectio {

struct TemplateSettings {
  double open_top_m = 4e-4;     // width of the opening at the surface
  double open_bottom_m = 2e-4;  // width of the opening at the bottom
  double right_angle_tolerance_rad = kRightAngleTolerance_rad;
  // New bottoms are made at this ratio of the tip's depth; the next step takes them to the tip's place.
  double bottom_at_birth = 0.75;
  double snap_ratio = 0.05;     // a crossing this close to a corner of its edge (ratio of its length) goes through it
  double snap_within_m = 5e-5;  // so does one next to a vertex this close to the blade's way, if nothing else succeeds
  double fold_m = 1e-3;         // and then faces may be folded over a front by this
  double inset = 0.04;          // least barycentric coordinate of a path's end inside a triangle
  double min_step_m = 1e-4;     // shorter motions of the blade wait for more
  double join_tolerance_m = 0.002;  // a blade this close to the front of a groove joins it, or continues it
  double patience_m = 0.005;        // an impossible step is postponed until the blade has gone this far
  double release_depth_m = -2e-4;   // the stroke ends when the depth of the tip is below this
};

// The template of a face, and the criteria by which it was chosen.
struct ActiveFace {
  std::array<VertexId, 3> corners{kNone, kNone, kNone};
  AngleClass angle = AngleClass::normal;
  int active_edges = 0;
  int vertices_inside = 0;
  const CutTemplate* chosen = nullptr;

  template <class A>
  void archive(A& a) {
    const std::span<const CutTemplate> all = cut_templates();
    auto number = static_cast<std::size_t>(chosen ? chosen - all.data() : -1);
    a(corners, angle, active_edges, vertices_inside, number);
    chosen = number < all.size() ? &all[number] : nullptr;
  }
};

using TargetStates = std::vector<std::pair<VertexId, VertexState>>;

enum class TemplateOutcome : std::uint8_t {
  cut,
  nothing,  // no face is active, or the blade has not moved
  refused,  // there is no valid subdivision; the draft is unchanged
};

inline constexpr std::string_view kNoPath = "the blade's path over the surface can't be followed";

struct TemplateStep {
  TemplateOutcome outcome = TemplateOutcome::nothing;
  std::string_view why;  // reason of a refusal, for a person
  std::vector<ActiveFace> faces;
  std::vector<CutFront> fronts;  // at the blade; none: it has left the body, or joined a groove
  std::vector<CutFront> starts;  // ends of grooves that begin with this step, where its first pose was
  TargetStates bottoms_at_tip;   // places to which the next step takes the new bottoms
  std::set<VertexId> bottoms;    // vertices that are new
};

// The mesh may allow one way over it and not another.
std::array<PathSnap, 5> snaps_to_try(const TemplateSettings& settings);

// Cuts one step, from one pose to the next. `active`: triangles that the sweep crosses, as the collision engine found
// them; one of each path is enough. With fronts, `first` is the pose there; with a target, `last` lies along the
// target, and the two grooves become one.
TemplateStep cut_with_templates(MeshDraft& draft, const RestBlade& first, const RestBlade& last, const SweepEnds& ends,
                                std::span<const TriangleId> active, const TemplateSettings& settings);

}  // namespace sectio

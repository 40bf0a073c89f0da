#include "sim_server/world/edge_stroke.h"

#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "sim_server/world/edge_meets_body.h"
#include "sim_server/world/whole_edge.h"

namespace sectio {
namespace {

// Tissue goes along with a blade that doesn't cut, further with a deeper one, until it slips off.
constexpr double kMostDrag_m = 0.004, kMostDragInDepths = 2, kMostWallDragInDepths = 0.5;
constexpr double kGoesAside_m = 8e-4;  // a hand that trembles goes less far aside
constexpr double kSteep = 0.5;         // cosine to the normal from which on a blade passes through a surface
constexpr double kLeftBehind = 3;  // join tolerances: a deep blade that is further from the end of its cut has left it
// Skin is dragged so far beyond the tip; inside of it the tip swings, in so many poses.
constexpr double kNoWay_m = 1e-5, kDragged_m = 0.01, kInside_m = 3e-4;
constexpr int kSwings = 12;
constexpr std::string_view kJawsOpened = "its jaws opened", kBeneath = "all of its edge is beneath the surface",
                           kCameOut = "its tip came out through another face";

// The length of a blade's edge beneath the surface at a point; for a blade that lies along the surface, up to the
// nearest point.
double height_m_at(const Vec3& point_world_m, const Vec3& normal, const Blade& blade) {
  const Vec3 from_tip = point_world_m - blade.tip_world_m;
  const double steepness = blade.up_world.dot(normal);
  return steepness > kSteep ? from_tip.dot(normal) / steepness : from_tip.dot(blade.up_world);
}

double most_drag_m(const Blade& blade, const Vec3& at_surface_world_m, double in_depths) {
  return kMostDrag_m + in_depths * (at_surface_world_m - blade.tip_world_m).norm();
}

Blade limited_blade(Body& body, const InstrumentEdge& edge, const Vec3& surface_world_m) {
  Blade blade = edge.blade();
  const double depth_m = (surface_world_m - blade.tip_world_m).dot(blade.up_world);
  if (depth_m > 0)
    blade.max_depth_m = body.depth_limit_m(blade.tip_world_m + depth_m * blade.up_world, blade.tip_world_m);
  return blade;
}

// The triangles that the line of a blade crosses.
void ask_surface(Body& body, const Blade& blade, std::vector<TriangleId>& crossed) {
  const BladeLine line = line_of(blade);
  for (const SurfaceHit& hit : body.tree().hits(body.view(), line.heel_world_m, line.tip_world_m))
    if (hit.entering) crossed.push_back(hit.triangle);
}

// A tip that comes out through another face than the one in which its cut ends opens that one, too, from the rim to
// where it comes out: as a blade does that swings about its tip. Nothing: no such face is near.
std::vector<Blade> swung_out(Body& body, const Blade& blade, const Vec3& tip_before_world_m) {
  const Vec3 way_m = blade.tip_world_m - tip_before_world_m;
  const Vec3 over = way_m - way_m.dot(blade.up_world) * blade.up_world;
  if (over.norm() < kNoWay_m) return {};
  const Vec3 ahead = over.normalized();
  const SurfaceView view = body.view();
  for (const SurfaceHit& hit : body.tree().hits(view, tip_before_world_m, tip_before_world_m + kDragged_m * ahead)) {
    if (hit.entering) continue;
    if (view.normal(hit.triangle).dot(blade.up_world) > kSteep) return {};
    std::vector<Blade> swung;
    for (int i = 1; i <= kSwings; ++i) {
      const double angle = 0.5 * std::numbers::pi * i / (kSwings + 1);
      swung.push_back(blade);
      swung.back().tip_world_m = hit.point_world_m - kInside_m * ahead;
      swung.back().up_world = std::cos(angle) * blade.up_world + std::sin(angle) * ahead;
    }
    return swung;
  }
  return {};
}

PointConstraint drag_end(Body& body, const StrokeStep& step, const Vec3& to_world_m) {
  const VertexId end = step.cut.follows;
  PointConstraint c = drag(end, body.particle_view().position(end), to_world_m, step.step_s);
  c.largest_force_n = step.edge.largest_force_n();
  return c;
}

// The way across the flat of the blade.
double aside_m(const InstrumentEdge& edge, const Vec3& way_world_m) {
  const auto sharp_side = edge.sharp_side_world();
  return sharp_side ? std::abs(way_world_m.dot(sharp_side->cross(edge.along_world_m()).normalized())) : 0;
}

// The edge is out, and what it came through is cut.
bool edge_has_left(Body& body, const InstrumentEdge& edge) {
  if (!is_clear_of(body, edge)) return false;
  const auto sharp_side = edge.sharp_side_world();
  return !sharp_side || !uncut_tissue_at(body, edge, edge.tip_world_m() - kDeepEdge_m * *sharp_side);
}

// The decision for a pose of an edge that cuts where its tip goes.
struct TipDecision {
  CutDecision leaf = CutDecision::detect_again;
  Vec3 at_surface_world_m = Vec3::Zero();
  double height_m = 0;  // the surface above the tip
  Crossings crossings;
};

// A pose of an edge on its way through tissue, and how it has come there.
struct EdgeOnWay {
  const InstrumentEdge& edge;
  const Blade& blade;
  Jaws jaws;
  Vec3 from_world_m;    // on the surface, where it has cut last
  Vec3 travel_world_m;  // way of the tip since then

  TipDecision decide(const Vec3& point_world_m, const Vec3& normal) const {
    TipDecision d;
    d.height_m = height_m_at(point_world_m, normal, blade);
    d.at_surface_world_m = blade.tip_world_m + d.height_m * blade.up_world;
    d.crossings = crossings_at(edge.shape(), edge.pose(), point_world_m, normal);
    const Vec3 over_surface = d.at_surface_world_m - from_world_m;
    const bool is_correct = correct_direction(edge.shape(), edge.pose(), over_surface, normal) ||
                            correct_direction(edge.shape(), edge.pose(), travel_world_m, normal);
    d.leaf = edge.kind().decide({d.crossings, is_correct, jaws});
    return d;
  }
};

}  // namespace

BladeMotion EdgeStroke::begin(Body& body, const InstrumentEdge& edge, const Vec3& point_world_m, double sideways_m) {
  tip_before_world_m_ = cut_at_world_m_ = edge.tip_world_m();
  drags_end_ = false;
  goes_aside_ = false;
  sides_ = {};
  BladeMotion motion{edge.id(), {limited_blade(body, edge, point_world_m)}, false};
  if (!body.cut_traits.edge_cuts_anywhere) {
    ask_surface(body, motion.path.front(), motion.active);
    return motion;
  }
  // A blade that breaks in sideways comes from outside.
  if (sideways_m > 0)
    if (const auto outside = blade_outside(body, edge, motion.path.front(), sideways_m))
      motion.path.insert(motion.path.begin(), *outside);
  motion.active = swept_over(body, edge, motion.path.front(), motion.path);
  return motion;
}

EdgeStroke::Outcome EdgeStroke::follow(Body& body, const StrokeStep& step) {
  return body.cut_traits.edge_cuts_anywhere ? follow_whole_edge(body, step) : follow_tip(body, step);
}

// Both on the way since the last cut, and from where the end of the cut was at rest: others may hold tissue aside.
bool EdgeStroke::tissue_slips_off(const Body& body, const StrokeStep& step, const Blade& blade,
                                  const Vec3& at_surface_world_m) const {
  const Vec3 at_rest_world_m = step.frame_world.to_world(body.mesh.rest_body_m(step.cut.follows));
  const double dragged_m =
      std::min((blade.tip_world_m - tip_before_world_m_).norm(), (at_surface_world_m - at_rest_world_m).norm());
  return dragged_m > most_drag_m(blade, at_surface_world_m, kMostDragInDepths);
}

// The decision tree of figure 4, for each pose; the first one that does not cut ends what is cut in this step.
EdgeStroke::Outcome EdgeStroke::follow_tip(Body& body, const StrokeStep& step) {
  const InstrumentKind& kind = step.edge.kind();
  Outcome outcome{{step.edge.id(), {}, false}, {}};
  BladeMotion& motion = outcome.motion;
  const std::array resting{step.edge.pose()};
  Vec3 from = step.point_world_m;
  double opening_rad = step.opening_before_rad;
  for (const JointPose& pose : step.poses.empty() ? std::span<const JointPose>(resting) : step.poses) {
    const InstrumentEdge edge = step.edge.at(pose);
    const Jaws jaws = jaws_between(std::exchange(opening_rad, pose.opening_rad), pose.opening_rad);
    const Blade blade = limited_blade(body, edge, step.point_world_m);
    const EdgeOnWay way{edge, blade, jaws, from, blade.tip_world_m - tip_before_world_m_};
    TipDecision decision = way.decide(step.point_world_m, step.normal_world);
    const bool is_beneath = decision.height_m > 0;
    // Over a rim, the blade enters another face than the one with the end of its cut.
    if (decision.leaf == CutDecision::detect_again) {
      const BladeLine line = line_of(blade);
      if (const auto skin = skin_entered(body, line, line.tip_world_m))
        decision = way.decide(skin->point_world_m, body.view().normal(skin->triangle));
    }
    resistance_.meet(body, edge, step.frame_world, step.cut.near,
                     kind.only_closing && decision.leaf != CutDecision::cut);
    if (decision.leaf == CutDecision::cut) {
      motion.has_dragged_end |= std::exchange(drags_end_, false);
      motion.path.push_back(blade);
      ask_surface(body, blade, motion.active);
      from = decision.at_surface_world_m;
      tip_before_world_m_ = blade.tip_world_m;
      continue;
    }
    if (decision.leaf == CutDecision::detect_again) {
      motion.lift = decision.height_m < 0 || !decision.crossings.edge || jaws == Jaws::opening;
      if (!motion.lift) break;
      outcome.why_lifted = jaws == Jaws::opening ? kJawsOpened : decision.height_m < 0 ? kLifted : kBeneath;
      if (jaws == Jaws::opening || !is_beneath || !step.cut.cuts || step.cut.follows == kNone) break;
      for (const Blade& swung : swung_out(body, blade, tip_before_world_m_)) {
        motion.path.push_back(swung);
        ask_surface(body, swung, motion.active);
        outcome.why_lifted = kCameOut;
      }
      break;
    }
    if (decision.leaf == CutDecision::push_out) resistance_.push_out(body, edge, step.point_world_m, step.normal_world);
    outcome.is_sunk = decision.leaf == CutDecision::push_out || decision.leaf == CutDecision::deform_with_shaft;
    if (!step.cut.cuts || step.cut.follows == kNone) break;
    outcome.slips = motion.lift = tissue_slips_off(body, step, blade, decision.at_surface_world_m);
    if (outcome.slips) outcome.why_lifted = outcome.is_sunk ? kSunk : kAside;
    drags_end_ = !outcome.slips;
    if (drags_end_) outcome.held = {drag_end(body, step, decision.at_surface_world_m)};
    break;
  }
  return outcome;
}

EdgeStroke::Outcome EdgeStroke::follow_whole_edge(Body& body, const StrokeStep& step) {
  const InstrumentKind& kind = step.edge.kind();
  Outcome outcome{{step.edge.id(), {}, false}, {}};
  BladeMotion& motion = outcome.motion;
  Vec3 from = step.point_world_m;
  double opening_rad = step.opening_before_rad;
  Vec3 way_world_m = Vec3::Zero();
  if (step.poses.empty()) resistance_.meet(body, step.edge, step.frame_world, step.cut.near, kind.only_closing);
  for (const JointPose& pose : step.poses) {
    const InstrumentEdge edge = step.edge.at(pose);
    const Jaws jaws = jaws_between(std::exchange(opening_rad, pose.opening_rad), pose.opening_rad);
    const Blade blade = edge.blade();
    const Vec3 travel = blade.tip_world_m - std::exchange(tip_before_world_m_, blade.tip_world_m);
    way_world_m += travel;
    resistance_.meet(body, edge, step.frame_world, step.cut.near, kind.only_closing && jaws != Jaws::closing);
    if (travel.norm() < kNoTravel_m && jaws == Jaws::still) continue;
    const double depth_m = (from - blade.tip_world_m).dot(blade.up_world);
    const Vec3 at_surface = blade.tip_world_m + depth_m * blade.up_world;
    const bool ahead = correct_direction(edge.shape(), pose, at_surface - from, blade.up_world);
    const bool is_correct = ahead || correct_direction(edge.shape(), pose, travel, blade.up_world);
    const CutDecision leaf = decide_by_surface(body, edge, is_correct, jaws);
    if (leaf == CutDecision::cut || (leaf == CutDecision::detect_again && ahead)) {
      if (ahead || (leaf == CutDecision::cut && body.cut_traits.cuts_inside)) {
        motion.path.push_back(blade);
        cut_at_world_m_ = blade.tip_world_m;
        goes_aside_ = false;
        sides_ = {};
        const bool is_beyond = (at_surface - from).norm() > body.cut_traits.join_tolerance_m;
        from = at_surface;
        motion.lift =
            body.cut_traits.cuts_inside && leaf == CutDecision::detect_again && is_beyond && edge_has_left(body, edge);
        if (!motion.lift) continue;
        outcome.why_lifted = kLeft;
        break;
      }
    } else if (leaf == CutDecision::push_back && body.cut_traits.cuts_inside) {
      goes_aside_ |= aside_m(edge, blade.tip_world_m - cut_at_world_m_) > kGoesAside_m;
      outcome.slips = motion.lift = sides_.aside_m() > most_drag_m(blade, at_surface, kMostWallDragInDepths);
      if (!outcome.slips) continue;
      outcome.why_lifted = kAside;
      break;
    } else if (leaf == CutDecision::detect_again) {  // in what it has opened, or out of it
      // Lips that swing away from a blade do not lift it.
      const double near_m = body.cut_traits.join_tolerance_m,
                   away_m = (depth_m > kDeepEdge_m ? kLeftBehind : 1) * near_m;
      const bool is_away = depth_m < -near_m || (at_surface - from).norm() > away_m;
      const bool has_left = is_away && !tip_is_in_groove(body, edge);
      motion.lift = jaws == Jaws::opening || has_left;
      if (motion.lift && jaws == Jaws::opening) outcome.why_lifted = kJawsOpened;
      break;
    }
  }
  if (!motion.path.empty())
    motion.active = swept_over(body, step.edge, step.cut.blade.value_or(motion.path.front()), motion.path);
  if (goes_aside_ && !motion.lift) outcome.held = sides_.press(body, step.edge, way_world_m);
  return outcome;
}

}  // namespace sectio

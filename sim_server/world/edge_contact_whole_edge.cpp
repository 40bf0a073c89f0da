// An instrument that cuts with templates (paper A, 2.3): its edge may break the surface anywhere along its length, and
// every part of the edge in the body cuts. The surface itself is asked which parts are in the body; a plane would not
// do at an edge of the body, or at the point where the blade comes out on the other side.
#include <algorithm>
#include <utility>

#include "sim_server/world/edge_contact.h"

namespace sectio {
namespace {

constexpr double kDeep_m = 0.003;         // an edge this deep in tissue has broken in
constexpr double kLeastInside_m = 0.001;  // of its length
constexpr double kFarthestBack_m = 0.03;  // from where a blade that breaks in sideways is looked for outside the body
constexpr double kBackStep_m = 0.00025;
constexpr double kClear_m = 0.002;  // further back: at rest the body's side is nearer than where it is pressed in
constexpr double kAlongWall = 0.5;  // cosine of a wall's normal to the blade's, from which on they lie side by side
constexpr double kCosSharp = 0.5;   // the edge faces the surface within 60 degrees

}  // namespace

bool EdgeContact::sharp_edge_touches(const InstrumentShape& shape) const {
  constexpr std::array<std::size_t, 2> kEdgeCorners{0, 2};  // A and C
  if (!body_.cut_traits.edge_cuts_anywhere || at_tip_ || contact_corners_ != kEdgeCorners) return false;
  const double along_m = contact_along_ * (shape.c_tool_m - shape.a_tool_m).norm();
  return along_m <= (shape.edge_heel_tool_m - shape.edge_tip_tool_m).norm();  // blunt beyond
}

bool EdgeContact::sharp_edge_presses() const {
  const InstrumentShape shape = shape_at(pose_.opening_rad);
  if (!sharp_edge_touches(shape)) return false;
  if (shape.sharp_side_tool && !body_.cut_traits.cuts_inside && is_at_wall(shape, contact_world_m())) return false;
  return !shape.sharp_side_tool || -normal_.dot(pose_.orientation * *shape.sharp_side_tool) >= kCosSharp;
}

// Is the edge in a groove, with walls close to both its sides? A blade that is put back into its cut then goes on
// without breaking in.
bool EdgeContact::sharp_edge_is_in_slit() const {
  const InstrumentShape shape = shape_at(pose_.opening_rad);
  if (!sharp_edge_touches(shape) || !shape.sharp_side_tool || !body_.cut_traits.cuts_inside) return false;
  return is_between_walls(shape, contact_world_m());
}

// Is the blade in a groove, or flat against a wall of one? There it cuts nothing: it would plane off its own walls.
bool EdgeContact::is_at_wall(const InstrumentShape& shape, const Vec3& at) const {
  const Vec3 edge = shape.edge_heel_tool_m - shape.edge_tip_tool_m;
  const Vec3 aside = pose_.orientation * shape.sharp_side_tool->cross(edge).normalized();
  const double near_m = body_.cut_traits.join_tolerance_m;
  const auto is_beside = [&](const SurfaceHit& hit) {
    return body_.mesh.triangle(hit.triangle).surface == Surface::wall &&
           std::abs(body_.view().normal(hit.triangle).dot(aside)) > kAlongWall;
  };
  return is_between_walls(shape, at) ||
         std::ranges::any_of(body_.tree().hits(body_.view(), at - near_m * aside, at + near_m * aside), is_beside);
}

bool EdgeContact::is_between_walls(const InstrumentShape& shape, const Vec3& at) const {
  const Vec3 edge = shape.edge_heel_tool_m - shape.edge_tip_tool_m;
  const Vec3 aside = pose_.orientation * shape.sharp_side_tool->cross(edge).normalized();
  const Vec3 reach = body_.cut_traits.join_tolerance_m * aside;
  const std::vector<SurfaceHit> hits = body_.tree().hits(body_.view(), at - reach, at + reach);
  const auto is_wall = [&](bool entering) {
    return std::ranges::any_of(hits, [&](const SurfaceHit& hit) {
      return hit.entering == entering && body_.mesh.triangle(hit.triangle).surface == Surface::wall;
    });
  };
  return is_wall(true) && is_wall(false);
}

// Surface that springs round an edge, or over a rim, leaves nothing that could press it: the blade would pass through
// uncut tissue. In a slit, whose lips may have closed in on the blade, there is nothing to break in to.
std::optional<SurfaceHit> EdgeContact::sharp_edge_deep_inside(const JointPose& before) const {
  const InstrumentShape shape = shape_at(pose_.opening_rad);
  if (!cuts_ || !shape.sharp_side_tool) return {};
  const Vec3 sharp_side = pose_.orientation * *shape.sharp_side_tool;
  const Vec3 tip = pose_.to_world(shape.edge_tip_tool_m) - kDeep_m * sharp_side;
  const Vec3 edge = pose_.orientation * (shape.edge_heel_tool_m - shape.edge_tip_tool_m);
  if (sharp_side.dot(pose_.to_world(shape.edge_tip_tool_m) - before.to_world(shape.edge_tip_tool_m)) < kNoTravel_m)
    return {};
  return uncut_tissue_at(shape, tip, edge);
}

// A style that cuts where the tip goes has no cut for a blade that goes through the body beside its tip.
void EdgeContact::say_when_tip_is_outside(const JointPose& before) {
  if (said_tip_is_outside_ || phase_ != Phase::pressing || body_.cut_traits.edge_cuts_anywhere || body_.rigid()) return;
  const Vec3 tip = edge_at(shape_at(pose_.opening_rad), pose_).tip_world_m;
  if (body_.tree().inside(body_.view(), tip) || !sharp_edge_deep_inside(before)) return;
  said_tip_is_outside_ = true;
  ++refused_;
  events_.push_back({EventKind::cut_refused, "the edge went in, but the tip, which cuts in this style, is outside"});
}

// The first part of a line along the edge that is in tissue which no cut has opened.
std::optional<SurfaceHit> EdgeContact::uncut_tissue_at(const InstrumentShape& shape, const Vec3& tip,
                                                       const Vec3& edge) const {
  const std::vector<SurfaceHit> hits = body_.tree().hits(body_.view(), tip, tip + edge);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const double from = hits[i].entering ? hits[i].parameter : 0;
    const double to = !hits[i].entering ? hits[i].parameter : i + 1 < hits.size() ? hits[i + 1].parameter : 1;
    if ((!hits[i].entering && i > 0) || (to - from) * edge.norm() < kLeastInside_m) continue;
    const Vec3 middle = tip + 0.5 * (from + to) * edge;
    if (!body_.cut_traits.cuts_inside && (!body_.tree().inside(body_.view(), middle) || is_at_wall(shape, middle)))
      continue;  // walls that hang into each other are entered and never left
    Blade part;
    part.tip_world_m = tip + from * edge;
    part.up_world = edge.normalized();
    part.length_m = (to - from) * edge.norm();
    const VertexId near = body_.mesh.triangle(hits[i].triangle).v[0];
    if (body_.engines.cutting->uncut_m(body_.shared(), part, near) > kLeastInside_m) return hits[i];
  }
  return {};
}

// A blade that breaks in sideways comes from outside, with the surface that it has pushed in between.
void EdgeContact::begin_with_whole_edge(BladeMotion& motion) {
  const InstrumentShape shape = shape_at(pose_.opening_rad);
  const double length_m = (shape.edge_heel_tool_m - shape.edge_tip_tool_m).norm();
  const SurfaceView view = body_.view();
  if (!at_tip_ && shape.sharp_side_tool) {
    const Vec3 back = -(pose_.orientation * *shape.sharp_side_tool);
    const CollisionEngine& tree = body_.tree();
    std::optional<Blade> outside;
    double most_m = kFarthestBack_m;
    for (double back_m = kBackStep_m; back_m <= most_m; back_m += kBackStep_m) {
      Blade blade = motion.path.front();
      blade.tip_world_m += back_m * back;
      const bool is_out = tree.hits(view, blade.tip_world_m, blade.tip_world_m + length_m * blade.up_world).empty() &&
                          !tree.inside(view, blade.tip_world_m);
      if (!is_out && outside) break;
      if (!is_out) continue;
      if (!outside) most_m = back_m + (opens_from_edge() ? kClear_m : 0);
      outside = blade;
    }
    if (outside) motion.path.insert(motion.path.begin(), *outside);
  }
  sweep_over({}, motion);
}

CutDecision EdgeContact::decide_by_surface(const InstrumentShape& shape, const JointPose& pose,
                                           bool is_correct_direction, Jaws jaws) {
  const SurfaceView view = body_.view();
  const CollisionEngine& tree = body_.tree();
  const auto hits = [&](const Vec3& from_tool_m, const Vec3& to_tool_m) {
    return tree.hits(view, pose.to_world(from_tool_m), pose.to_world(to_tool_m));
  };
  const auto edge = hits(shape.edge_tip_tool_m, shape.edge_heel_tool_m);
  const Crossings crossings{!hits(shape.a_tool_m, shape.b_tool_m).empty(),
                            !hits(shape.a_tool_m, shape.c_tool_m).empty(),
                            !hits(shape.b_tool_m, shape.d_tool_m).empty(), !edge.empty()};
  return instrument_.decide({crossings, is_correct_direction, jaws});
}

void EdgeContact::follow_with_whole_edge(const CutPoint& cut, std::span<const JointPose> poses,
                                         std::vector<BladeMotion>& motions) {
  if (cut.point_world_m) point_ = *cut.point_world_m;
  BladeMotion motion{edge_id_, {}, false};
  Vec3 from = point_;
  double opening_rad = opening_before_rad_;
  const Pose frame = body_.frame_world(cut.near);
  if (poses.empty()) meet_front(shape_at(pose_.opening_rad), pose_, frame, instrument_.only_closing);
  for (const JointPose& pose : poses) {
    const InstrumentShape shape = shape_at(pose.opening_rad);
    const Jaws jaws = jaws_between(std::exchange(opening_rad, pose.opening_rad), pose.opening_rad);
    const EdgeInWorld edge = edge_at(shape, pose);
    const Vec3 travel = edge.tip_world_m - std::exchange(tip_before_, edge.tip_world_m);
    meet_front(shape, pose, frame, instrument_.only_closing && jaws != Jaws::closing);
    if (travel.norm() < kNoTravel_m && jaws == Jaws::still) continue;
    const Vec3 at_surface = edge.tip_world_m + (from - edge.tip_world_m).dot(edge.up_world) * edge.up_world;
    const bool ahead = correct_direction(shape, pose, at_surface - from, edge.up_world);
    const CutDecision leaf =
        decide_by_surface(shape, pose, ahead || correct_direction(shape, pose, travel, edge.up_world), jaws);
    if (leaf == CutDecision::cut || (leaf == CutDecision::detect_again && ahead)) {
      if (ahead || (leaf == CutDecision::cut && body_.cut_traits.cuts_inside)) {
        motion.path.push_back({edge.tip_world_m, edge.up_world, 1e9, Vec3::Zero(),
                               (shape.edge_heel_tool_m - shape.edge_tip_tool_m).norm()});
        from = at_surface;
      }
    } else if (leaf == CutDecision::detect_again) {  // in what it has opened, or out of it
      // Lips that swing away from a blade do not lift it.
      const bool is_deep = (from - edge.tip_world_m).dot(edge.up_world) > kDeep_m;
      const double away_m = is_deep ? left_behind_m() : body_.cut_traits.join_tolerance_m;
      motion.lift = jaws == Jaws::opening || (at_surface - from).norm() > away_m;
      break;
    }
  }
  if (!motion.path.empty()) sweep_over(cut.blade, motion);
  motions.push_back(std::move(motion));
}

// The triangles that the blade comes near from the pose before to the last one.
void EdgeContact::sweep_over(const std::optional<Blade>& before, BladeMotion& motion) {
  const InstrumentShape shape = shape_at(pose_.opening_rad);
  const double length_m = (shape.edge_heel_tool_m - shape.edge_tip_tool_m).norm();
  const Blade first = before.value_or(motion.path.front());
  std::vector<Vec3> points{first.tip_world_m, first.tip_world_m + length_m * first.up_world};
  std::vector<std::array<std::size_t, 2>> segments{{0, 1}};
  double reach_m = 0;
  for (const Blade& blade : motion.path) {
    const std::size_t n = points.size();
    reach_m = std::max(reach_m, (blade.tip_world_m - points[n - 2]).norm());
    points.push_back(blade.tip_world_m);
    points.push_back(blade.tip_world_m + length_m * blade.up_world);
    segments.push_back({n, n + 1});
    segments.push_back({n - 2, n});
  }
  body_.tree().near_segments(body_.view(), points, segments, reach_m, motion.active);
}

}  // namespace sectio

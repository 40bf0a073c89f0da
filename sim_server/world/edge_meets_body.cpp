#include "sim_server/world/edge_meets_body.h"

#include <algorithm>

#include "common/math/intersect.h"

namespace sectio {
namespace {

constexpr double kIn_m = 3e-4;     // this far beneath the lid of a groove a blade is in it
constexpr double kAside_m = 5e-4;  // between looks for a lid beside a wall
constexpr int kMostAside = 6;      // looks

std::optional<SurfaceHit> first_entering(const std::vector<SurfaceHit>& hits) {
  const auto it = std::ranges::find_if(hits, &SurfaceHit::entering);
  return it != hits.end() ? std::optional(*it) : std::nullopt;
}

// The corner that touches first.
std::size_t tip_corner(const InstrumentKind& kind) {
  return kind.front_is_virtual ? 2 : 0;
}

}  // namespace

bool is_near(Body& body, const InstrumentEdge& edge, const std::optional<JointPose>& before,
             std::span<const JointPose> poses) {
  Box3 tool;
  const auto extend = [&](const JointPose& pose) {
    for (const Vec3& corner : edge.at(pose).corners().at_world_m) tool.extend(corner);
  };
  if (before) extend(*before);
  for (const JointPose& pose : poses) extend(pose);
  return !tool.isEmpty() && grown(body.bounds_world_m(), kToolReach_m).intersects(tool);
}

bool is_clear_of(Body& body, const InstrumentEdge& edge) {
  const ToolCorners corners = edge.corners();
  const CollisionEngine& tree = body.tree();
  if (tree.inside(body.view(), corners.at_world_m[0])) return false;
  return std::ranges::all_of(kSegmentCorners, [&](const auto& ends) {
    return tree.hits(body.view(), corners.at_world_m[ends[0]], corners.at_world_m[ends[1]]).empty();
  });
}

bool lower_blade_is_clear_of(Body& body, const InstrumentEdge& edge) {
  const auto& [tip, handle, pivot, upper] = edge.corners().at_world_m;
  return !body.tree().inside(body.view(), tip) && body.tree().hits(body.view(), tip, pivot).empty();
}

std::optional<SurfaceHit> reaches_in(Body& body, const InstrumentEdge& edge, const ToolContact& contact) {
  if (edge.shape().edge_tip_tool_m == edge.shape().edge_heel_tool_m) return {};
  if (!edge.kind().front_is_virtual)
    return first_entering(body.tree().hits(body.view(), edge.heel_world_m(), edge.tip_world_m()));
  if (const auto hit = first_entering(contact[ToolSegment::cd].after)) return hit;
  return first_entering(contact.path(ToolCorner::d));
}

std::optional<Pressing> tip_presses(const InstrumentKind& kind, const ToolContact& contact) {
  const std::size_t tip = tip_corner(kind);
  if (const auto hit = first_entering(contact.corner_paths[tip]))
    return Pressing{{{tip, tip}, 0, kind.presses_with_tip}, *hit};
  // The surface may have risen over a tip that rests: then the blade leaves the tissue before it enters it.
  const std::vector<SurfaceHit>& shaft = contact[ToolSegment::ab].after;
  if (kind.presses_with_tip && !shaft.empty() && !shaft.front().entering)
    return Pressing{{{tip, tip}, 0, true}, shaft.front()};
  return {};
}

// The middle of the part that is inside presses.
std::optional<Pressing> side_presses(const InstrumentKind& kind, const ToolContact& contact) {
  for (const ToolSegment segment : {ToolSegment::ab, ToolSegment::ac, ToolSegment::cd}) {
    const std::vector<SurfaceHit>& hits = contact[segment].after;
    if (hits.empty() || (kind.front_is_virtual && segment == ToolSegment::cd)) continue;
    const double from = hits.front().entering ? hits.front().parameter : 0;
    const double to = !hits.front().entering ? hits.front().parameter : hits.size() > 1 ? hits[1].parameter : 1;
    return Pressing{{kSegmentCorners[static_cast<std::size_t>(segment)], 0.5 * (from + to), false}, hits.front()};
  }
  return {};
}

std::optional<SurfaceHit> skin_entered(Body& body, const BladeLine& line, const Vec3& down_to_world_m) {
  for (const SurfaceHit& hit : body.tree().hits(body.view(), line.heel_world_m, down_to_world_m))
    if (hit.entering && body.mesh.triangle(hit.triangle).surface == Surface::skin) return hit;
  return {};
}

std::optional<Entry> enters_open_cut(Body& body, const InstrumentEdge& edge, std::optional<TriangleId> wall) {
  Blade blade = edge.blade();
  const auto is_in = [&](const Vec3& above_world_m) {
    return (above_world_m - blade.tip_world_m).dot(blade.up_world) >= kIn_m;
  };
  const BladeLine line = line_of(blade);
  if (wall)
    if (const auto skin = skin_entered(body, line, line.tip_world_m); skin && is_in(skin->point_world_m))
      return Entry{edge.id(), skin->triangle, skin->bary};
  auto cut = body.engines.cutting->in_open_cut(body.shared(), blade);
  // A tip that has slid from the skin over the end of a groove presses the wall: the lid is a little aside.
  for (int look = 0; wall && !cut && look < kMostAside; ++look) {
    blade.tip_world_m += kAside_m * body.view().normal(*wall);
    cut = body.engines.cutting->in_open_cut(body.shared(), blade);
  }
  if (!cut || !is_in(cut->point_world_m) || skin_entered(body, line, cut->point_world_m)) return {};
  return Entry{edge.id(), cut->beside, Vec3::Constant(1.0 / 3)};
}

}  // namespace sectio

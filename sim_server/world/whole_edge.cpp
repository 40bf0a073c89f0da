#include "sim_server/world/whole_edge.h"

#include <algorithm>
#include <cmath>

namespace sectio {
namespace {

constexpr double kLeastInside_m = 0.001;  // length of the edge inside
constexpr double kFarthestBack_m = 0.03;  // a blade that breaks in sideways is looked for outside the body up to here
constexpr double kBackStep_m = 0.00025;
constexpr double kClear_m = 0.002;  // further back: at rest the body's side is nearer than where it is pressed in
constexpr double kAlongWall = 0.5;  // least cosine between the normals of a wall and of a blade that lie side by side
constexpr double kPastSlit_m = 0.0003;     // an edge so far beyond the end of its slit has broken in
constexpr double kWidestGroove_m = 0.005;  // distance from a blade to the walls on both its sides
constexpr double kBetweenHalves_m = 0.02;  // a wall so near is that of a half which the blade has cut off
constexpr double kCosSharp = 0.5;          // the edge faces the surface within 60 degrees

// Whether the line from A to another corner touches, where the edge along it, or ahead of it, is sharp.
bool line_touches(const Body& body, const InstrumentEdge& edge, const PressPoint::OnTool& at, std::size_t corner,
                  const Vec3& corner_tool_m) {
  if (!body.cut_traits.edge_cuts_anywhere || at.at_tip || at.corners != std::array<std::size_t, 2>{0, corner})
    return false;
  return at.along * (corner_tool_m - edge.shape().a_tool_m).norm() <= edge.length_m();  // blunt beyond
}

bool sharp_edge_touches(const Body& body, const InstrumentEdge& edge, const PressPoint::OnTool& at) {
  return line_touches(body, edge, at, 2, edge.shape().c_tool_m);
}

// Tissue that the shaft presses, behind a sharp edge that leads, has that edge in it.
bool shaft_presses_behind_edge(const Body& body, const InstrumentEdge& edge, const PressPoint::OnTool& at) {
  const InstrumentShape& shape = edge.shape();
  if (!shape.sharp_side_tool || (shape.c_tool_m - shape.a_tool_m).dot(*shape.sharp_side_tool) <= 0) return false;
  return line_touches(body, edge, at, 1, shape.b_tool_m);
}

// Unit, across the flat of the blade.
Vec3 aside_world(const InstrumentEdge& edge) {
  const InstrumentShape& shape = edge.shape();
  const Vec3 along = shape.edge_heel_tool_m - shape.edge_tip_tool_m;
  return edge.pose().orientation * shape.sharp_side_tool->cross(along).normalized();
}

bool is_between_walls(Body& body, const InstrumentEdge& edge, const Vec3& at, double reach_m) {
  const Vec3 reach = reach_m * aside_world(edge);
  const std::vector<SurfaceHit> hits = body.tree().hits(body.view(), at - reach, at + reach);
  const auto is_wall = [&](bool entering) {
    return std::ranges::any_of(hits, [&](const SurfaceHit& hit) {
      return hit.entering == entering && body.mesh.triangle(hit.triangle).surface == Surface::wall;
    });
  };
  return is_wall(true) && is_wall(false);
}

// Is the blade in a groove, or flat against a wall of one? There it cuts nothing: it would plane off its own walls.
// An edge that cuts in any direction has no flat.
bool is_at_wall(Body& body, const InstrumentEdge& edge, const Vec3& at, double near_m) {
  if (!edge.shape().sharp_side_tool) return false;
  const Vec3 aside = aside_world(edge);
  const auto is_beside = [&](const SurfaceHit& hit) {
    return body.mesh.triangle(hit.triangle).surface == Surface::wall &&
           std::abs(body.view().normal(hit.triangle).dot(aside)) > kAlongWall;
  };
  return is_between_walls(body, edge, at, near_m) ||
         std::ranges::any_of(body.tree().hits(body.view(), at - near_m * aside, at + near_m * aside), is_beside);
}

struct UncutPart {
  SurfaceHit entered;
  Vec3 middle_world_m;
};

// The first part of a line along the edge, from its tip on, that is in tissue which no cut has opened.
std::optional<UncutPart> uncut_part(Body& body, const InstrumentEdge& edge, const Vec3& tip) {
  const Vec3 along = edge.along_world_m();
  const std::vector<SurfaceHit> hits = body.tree().hits(body.view(), tip, tip + along);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const double from = hits[i].entering ? hits[i].parameter : 0;
    const double to = !hits[i].entering ? hits[i].parameter : i + 1 < hits.size() ? hits[i + 1].parameter : 1;
    if ((!hits[i].entering && i > 0) || (to - from) * along.norm() < kLeastInside_m) continue;
    const Vec3 middle = tip + 0.5 * (from + to) * along;
    const double near_m = body.cut_traits.join_tolerance_m;
    if (!body.cut_traits.cuts_inside &&
        (!body.tree().inside(body.view(), middle) || is_at_wall(body, edge, middle, near_m)))
      continue;  // walls that hang into each other are entered and never left
    // The stump of a part that has come off swings against the blade.
    if (body.engines.cutting->has_come_apart() && is_at_wall(body, edge, middle, kWidestGroove_m)) continue;
    Blade part;
    part.tip_world_m = tip + from * along;
    part.up_world = along.normalized();
    part.length_m = (to - from) * along.norm();
    const VertexId near = body.mesh.triangle(hits[i].triangle).v[0];
    if (body.engines.cutting->uncut_m(body.shared(), part, near) > kLeastInside_m) return UncutPart{hits[i], middle};
  }
  return {};
}

}  // namespace

bool sharp_edge_presses(Body& body, const InstrumentEdge& edge, const PressPoint& press, const Vec3& normal_world) {
  const PressPoint::OnTool& at = press.on_tool();
  if (!sharp_edge_touches(body, edge, at) && !shaft_presses_behind_edge(body, edge, at)) return false;
  const std::optional<Vec3> sharp_side = edge.sharp_side_world();
  if (!sharp_side) return true;
  if (!body.cut_traits.cuts_inside &&
      is_at_wall(body, edge, press.tool_point_world_m(edge), body.cut_traits.join_tolerance_m))
    return false;
  return -normal_world.dot(*sharp_side) >= kCosSharp;
}

bool back_presses(const InstrumentEdge& edge, const Vec3& normal_world) {
  const std::optional<Vec3> sharp_side = edge.sharp_side_world();
  return sharp_side && normal_world.dot(*sharp_side) > std::max(kCosSharp, normal_world.dot(edge.blade().up_world));
}

bool sharp_edge_is_in_slit(Body& body, const InstrumentEdge& edge, const PressPoint& press) {
  if (!sharp_edge_touches(body, edge, press.on_tool())) return false;
  if (!edge.shape().sharp_side_tool || !body.cut_traits.cuts_inside) return false;
  return is_between_walls(body, edge, press.tool_point_world_m(edge), body.cut_traits.join_tolerance_m);
}

bool is_beside_wall(Body& body, const InstrumentEdge& edge) {
  constexpr int kPlaces = 5;
  for (int i = 0; i < kPlaces; ++i)
    if (is_at_wall(body, edge, edge.tip_world_m() + static_cast<double>(i) / (kPlaces - 1) * edge.along_world_m(),
                   kBetweenHalves_m))
      return true;
  return false;
}

bool tip_is_in_groove(Body& body, const InstrumentEdge& edge) {
  if (!edge.shape().sharp_side_tool) return false;
  return is_between_walls(body, edge, edge.tip_world_m(), kWidestGroove_m);
}

bool tip_will_be_in_groove(const Body& body, const InstrumentEdge& edge, const Pose& frame_world) {
  const Vec3 tip_at_rest_m = frame_world.to_local(edge.tip_world_m());
  const double near_m = body.cut_traits.join_tolerance_m;
  return std::ranges::any_of(body.mesh.triangles(), [&](const Triangle& t) {
    if (!t.alive() || t.surface != Surface::wall) return false;
    const Corners wall{body.mesh.rest_body_m(t.v[0]), body.mesh.rest_body_m(t.v[1]), body.mesh.rest_body_m(t.v[2])};
    return closest_on_triangle(tip_at_rest_m, wall).squared_distance < near_m * near_m;
  });
}

std::optional<SurfaceHit> uncut_tissue_at(Body& body, const InstrumentEdge& edge, const Vec3& tip) {
  const auto part = uncut_part(body, edge, tip);
  return part ? std::optional(part->entered) : std::nullopt;
}

// Surface that springs round an edge, or over a rim, leaves nothing that could press it: the blade would pass through
// uncut tissue. In a slit, whose lips may have closed in on the blade, there is nothing to break in to; at its end the
// edge is in, however little.
std::optional<SurfaceHit> sharp_edge_deep_inside(Body& body, const InstrumentEdge& edge, const JointPose& before) {
  const std::optional<Vec3> sharp_side = edge.sharp_side_world();
  if (!sharp_side) return {};
  const Vec3 tip = edge.tip_world_m();
  if (sharp_side->dot(tip - before.to_world(edge.shape().edge_tip_tool_m)) < kNoTravel_m) return {};
  const Vec3 behind = std::min(kDeepEdge_m, body.thinnest_m() / 2) * *sharp_side;
  if (const auto deep = uncut_tissue_at(body, edge, tip - behind)) return deep;
  if (!body.cut_traits.cuts_inside) return {};
  const auto part = uncut_part(body, edge, tip - kPastSlit_m * *sharp_side);
  if (!part || !is_between_walls(body, edge, part->middle_world_m - behind, body.cut_traits.join_tolerance_m))
    return {};
  return part->entered;
}

std::optional<Blade> blade_outside(Body& body, const InstrumentEdge& edge, const Blade& inside,
                                   double farthest_back_m) {
  const std::optional<Vec3> sharp_side = edge.sharp_side_world();
  if (!sharp_side) return {};
  const SurfaceView view = body.view();
  const CollisionEngine& tree = body.tree();
  std::optional<Blade> outside;
  double most_m = std::min(kFarthestBack_m, farthest_back_m);
  for (double back_m = kBackStep_m; back_m <= most_m; back_m += kBackStep_m) {
    Blade blade = inside;
    blade.tip_world_m -= back_m * *sharp_side;
    const Vec3 heel = blade.tip_world_m + edge.length_m() * blade.up_world;
    const bool is_out = (tree.hits(view, blade.tip_world_m, heel).empty() && !tree.inside(view, blade.tip_world_m)) ||
                        (body.cut_traits.cuts_inside && !uncut_tissue_at(body, edge, blade.tip_world_m));
    if (!is_out && outside) break;
    if (!is_out) continue;
    if (!outside) most_m = back_m + (opens_from_edge(body.cut_traits) ? kClear_m : 0);
    outside = blade;
  }
  return outside;
}

CutDecision decide_by_surface(Body& body, const InstrumentEdge& edge, bool is_correct_direction, Jaws jaws) {
  const InstrumentShape& shape = edge.shape();
  const SurfaceView view = body.view();
  const CollisionEngine& tree = body.tree();
  const auto crosses = [&](const Vec3& from_tool_m, const Vec3& to_tool_m) {
    return !tree.hits(view, edge.pose().to_world(from_tool_m), edge.pose().to_world(to_tool_m)).empty();
  };
  const Crossings crossings{crosses(shape.a_tool_m, shape.b_tool_m), crosses(shape.a_tool_m, shape.c_tool_m),
                            crosses(shape.b_tool_m, shape.d_tool_m),
                            crosses(shape.edge_tip_tool_m, shape.edge_heel_tool_m)};
  return edge.kind().decide({crossings, is_correct_direction, jaws});
}

std::vector<TriangleId> swept_over(Body& body, const InstrumentEdge& edge, const Blade& from,
                                   std::span<const Blade> path) {
  const auto heel = [&](const Blade& blade) -> Vec3 { return blade.tip_world_m + edge.length_m() * blade.up_world; };
  std::vector<Vec3> points{from.tip_world_m, heel(from)};
  std::vector<std::array<std::size_t, 2>> segments{{0, 1}};
  double reach_m = 0;
  for (const Blade& blade : path) {
    const std::size_t n = points.size();
    reach_m = std::max(reach_m, (blade.tip_world_m - points[n - 2]).norm());
    points.push_back(blade.tip_world_m);
    points.push_back(heel(blade));
    segments.push_back({n, n + 1});
    segments.push_back({n - 2, n});
  }
  std::vector<TriangleId> near;
  body.tree().near_segments(body.view(), points, segments, reach_m, near);
  return near;
}

}  // namespace sectio

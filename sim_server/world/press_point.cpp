#include "sim_server/world/press_point.h"

#include <algorithm>

#include "sim_server/surface/indentation/contact_places.h"
#include "sim_server/world/indentation.h"

namespace sectio {
namespace {

constexpr double kDeepestPress_m = 0.02;  // no hand presses further in a step

}  // namespace

void PressPoint::begin(const Body& body, const OnTool& on_tool, const SurfaceHit& hit) {
  on_tool_ = on_tool;
  triangle_ = original_triangle(body, hit.triangle);
  bary_ = body.contact.inverse ? Vec3(Vec3::Constant(1.0 / 3)) : hit.bary;
}

void PressPoint::stand_at_tip(TriangleId triangle, const Vec3& bary) {
  on_tool_ = {{0, 0}, 0, true};
  triangle_ = triangle;
  bary_ = bary;
}

Vec3 PressPoint::tool_point_world_m(const InstrumentEdge& edge) const {
  const InstrumentShape& shape = edge.shape();
  const std::array corners{shape.a_tool_m, shape.b_tool_m, shape.c_tool_m, shape.d_tool_m};
  const Vec3 &p = corners[on_tool_.corners[0]], &q = corners[on_tool_.corners[1]];
  return edge.pose().to_world(on_tool_.corners[0] == on_tool_.corners[1] ? p : Vec3(p + on_tool_.along * (q - p)));
}

Vec3 PressPoint::point_world_m(Body& body) const {
  const Corners c = body.view().corners(triangle_);
  return bary_[0] * c[0] + bary_[1] * c[1] + bary_[2] * c[2];
}

double PressPoint::depth_m(Body& body, const InstrumentEdge& edge) {
  const Vec3 tool_point = tool_point_world_m(edge);
  slide_to(body, tool_point);
  return std::max(0.0, (point_world_m(body) - tool_point).dot(body.view().normal(triangle_)));
}

std::optional<PointConstraint> PressPoint::press(Body& body, const InstrumentEdge& edge) {
  const Vec3 tool_point = tool_point_world_m(edge);
  slide_to(body, tool_point);
  if ((point_world_m(body) - tool_point).norm() > kDeepestPress_m) return {};
  PointConstraint c;
  c.v = body.mesh.triangle(triangle_).v;
  for (std::size_t i = 0; i < 3; ++i) c.w[i] = bary_[static_cast<int>(i)];
  c.target_world_m = tool_point;
  c.unilateral = true;
  c.normal = body.undeformed_normal_world(MeshDraft(body.mesh, body.particle_view()), c.v, bary_);
  return c;
}

// Walks downhill over neighbours to the point of the surface that is nearest to the instrument.
void PressPoint::slide_to(Body& body, const Vec3& tool_point_world_m) {
  const SurfaceView view = body.view();
  if (!view.alive(triangle_)) {
    ++searches_;
    const auto closest = body.tree().closest(view, tool_point_world_m, kDeepestPress_m);
    if (!closest) return;
    triangle_ = closest->triangle;
  }
  const MeshDraft surface(view.mesh, body.particle_view());
  const Pose frame = body.frame_world(view.mesh.triangle(triangle_).v[0]);
  const SurfacePoint at = on_tool_.at_tip
                              ? pressed_from(surface, triangle_, tool_point_world_m, frame.to_local(tool_point_world_m))
                              : nearest_from(surface, triangle_, tool_point_world_m);
  triangle_ = at.triangle;
  bary_ = at.bary;
}

// The point that presses, and along the instrument from there all places that are beneath the surface.
std::vector<ContactPoint> PressPoint::press_with_templates(Body& body, const InstrumentEdge& edge) {
  const Vec3 tool_point = tool_point_world_m(edge);
  const MeshDraft surface = original_surface(body);
  if (!surface.triangle(triangle_).alive()) {
    ++searches_;
    const auto closest = body.tree().closest(body.view(), tool_point, kDeepestPress_m);
    if (!closest) return {};
    triangle_ = original_triangle(body, closest->triangle);
    bary_.setConstant(1.0 / 3);
  }
  const Pose frame = body.frame_world(surface.triangle(triangle_).v[0]);
  const auto to_body = [&](const Vec3& x_world_m) -> Vec3 {
    return frame.orientation.conjugate() * (x_world_m - frame.position_m);
  };
  const auto normal_world = [&] { return body.undeformed_normal_world(surface, surface.triangle(triangle_).v, bary_); };
  const SurfacePoint at =
      seen_along(surface, triangle_, to_body(tool_point), frame.orientation.conjugate() * normal_world());
  triangle_ = at.triangle;
  bary_ = at.bary;
  const Vec3 normal = normal_world();
  const std::span<const ContactPoint> before = body.contact.points;
  std::vector<ContactPoint> points{{contact_place(surface, at, before), tool_point, normal, edge.id()}};
  ContactLine line{at.triangle, to_body(tool_point), {}, frame.orientation.conjugate() * normal};
  for (const std::size_t corner : corners_beside(edge.kind())) {
    line.corner_body_m = to_body(edge.corners().at_world_m[corner]);
    for (const PlaceOnLine& p : contact_places_along(surface, line, before))
      points.push_back({p.place, frame.to_world(p.target_body_m), normal, edge.id()});
  }
  return points;
}

// The ends of the lines from the point that presses: the neighbours of a corner, or both ends of a side.
std::vector<std::size_t> PressPoint::corners_beside(const InstrumentKind& kind) const {
  const auto& [first, second] = on_tool_.corners;
  if (first != second) return {first, second};
  std::vector<std::size_t> beside;
  for (const auto& [p, q] : kSegmentCorners) {
    if (kind.front_is_virtual && p == 2 && q == 3) continue;
    if (p == first) beside.push_back(q);
    if (q == first) beside.push_back(p);
  }
  return beside;
}

// The normal for a line along the surface; a line that leads into the surface has the surface beside it.
ContactGap PressPoint::gap(Body& body, const InstrumentEdge& edge, const Vec3& normal_world) const {
  constexpr int kSamples = 100;
  constexpr double kAlong = 0.5;    // cosine of a line's angle to the surface
  constexpr double kLook_m = 0.03;  // for the surface, up and down from the line
  const MeshDraft original = original_surface(body);
  const Pose frame = body.frame_world(original.triangle(triangle_).v[0]);
  const Eigen::Quaterniond to_body = frame.orientation.conjugate();
  const auto beneath_m = [&](const Vec3& q) {
    const SurfacePoint above =
        seen_along(original, triangle_, to_body * (q - frame.position_m), to_body * normal_world);
    return (body.undeformed_world_m(original.triangle(above.triangle).v, above.bary) - q).dot(normal_world);
  };
  const Vec3 from = tool_point_world_m(edge);
  ContactGap most{beneath_m(from), 0};
  for (const std::size_t corner : corners_beside(edge.kind())) {
    const Vec3 line = edge.corners().at_world_m[corner] - from;
    if ((line - line.dot(normal_world) * normal_world).norm() < kAlong * line.norm()) continue;
    for (int i = 0; i <= kSamples; ++i) {
      const Vec3 q = from + i / double{kSamples} * line;
      if (beneath_m(q) < 0.5 * most.depth_m) break;
      const Vec3 look = kLook_m * normal_world;
      double nearest_m = kLook_m;
      for (const SurfaceHit& hit : body.tree().hits(body.view(), q + look, q - look))
        nearest_m = std::min(nearest_m, (hit.point_world_m - q).norm());
      most.gap_m = std::max(most.gap_m, nearest_m);
    }
  }
  return most;
}

}  // namespace sectio

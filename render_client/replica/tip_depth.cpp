#include "render_client/replica/tip_depth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/math/intersect.h"

namespace sectio {

namespace {

// Signed solid angle of a triangle seen from the origin (van Oosterom and Strackee 1983).
double solid_angle(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  return 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

double depth_m(const BodyFrame& body, const Vec3& tip_world_m) {
  Vec3f low = Vec3f::Constant(std::numeric_limits<float>::max()), high = -low;
  for (const Triangle& triangle : body.triangles) {
    if (!triangle.alive()) continue;
    for (const VertexId v : triangle.v) {
      low = low.cwiseMin(body.positions_world_m[v]);
      high = high.cwiseMax(body.positions_world_m[v]);
    }
  }
  const Vec3f tip = tip_world_m.cast<float>();
  if ((tip.array() < low.array()).any() || (tip.array() > high.array()).any()) return 0;

  double angle = 0;
  double nearest = std::numeric_limits<double>::max();
  Surface nearest_surface = Surface::skin;
  for (const Triangle& triangle : body.triangles) {
    if (!triangle.alive()) continue;
    const auto corner = [&](std::size_t i) -> Vec3 {
      return body.positions_world_m[triangle.v[i]].cast<double>() - tip_world_m;
    };
    const Vec3 a = corner(0), b = corner(1), c = corner(2);
    angle += solid_angle(a, b, c);
    const double distance = closest_on_triangle(Vec3::Zero(), {a, b, c}).squared_distance;
    if (distance >= nearest) continue;
    nearest = distance;
    nearest_surface = triangle.surface;
  }
  const bool inside = angle > 2 * std::numbers::pi;
  return inside && nearest_surface == Surface::skin ? std::sqrt(nearest) : 0;
}

}  // namespace

double visible_tip_depth_m(const Frame& frame) {
  double deepest = 0;
  for (const ToolFrame& tool : frame.tools) {
    if (!tool.present) continue;
    const Vec3 tip_world_m = tool.pose_world.to_world(tool.abcd_tool_m[0]);
    for (const BodyFrame& body : frame.bodies) deepest = std::max(deepest, depth_m(body, tip_world_m));
  }
  return deepest;
}

}  // namespace sectio

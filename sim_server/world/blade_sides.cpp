#include "sim_server/world/blade_sides.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "sim_server/world/contact_layer.h"
#include "sim_server/world/triangle_lattice.h"

namespace sectio {
namespace {

constexpr double kSpacing_m = 0.0015;   // between samples, and between the lines in which walls are looked for
constexpr double kFree_m = 8e-4;        // a wall gives way to the blade so far
constexpr double kBesideFlat_m = 5e-4;  // a wall this far from the flat is beside it
constexpr double kAtMost_m = 0.001;     // a wall that it comes to is no deeper
constexpr double kGives_m = 0.002;      // the layer of tissue gives way by no more
constexpr double kPresses_m = 2e-4;     // a wall this deep is pressed
constexpr double kDeepest_m = 0.003;    // and stays so down to here
constexpr double kAlongFlat = 0.5;      // least cosine between the normals of a wall and of the flat that it lies along
constexpr double kOver_m = 3e-4;        // the flat reaches so far over its corners
constexpr double kHighest_m = 0.05;     // the part of the flat that is looked at
constexpr int kMostInEdge = 8;          // samples along an edge

// A flat in its own plane: along the shaft from the tip, and towards the sharp side.
struct Flat {
  Vec3 tip_world_m, axis, ahead, aside;      // unit vectors
  std::array<Eigen::Vector2d, 4> corners_m;  // A, C, D, B

  explicit Flat(const InstrumentEdge& edge) {
    const InstrumentShape& shape = edge.shape();
    const auto& turn = edge.pose().orientation;
    const Vec3 axis_tool = (shape.b_tool_m - shape.a_tool_m).stableNormalized();
    tip_world_m = edge.pose().to_world(shape.a_tool_m);
    axis = turn * axis_tool;
    ahead = turn * *shape.sharp_side_tool;
    aside = ahead.cross(axis);
    const auto at = [&](const Vec3& tool_m) {
      const Vec3 from_tip = tool_m - shape.a_tool_m;
      return Eigen::Vector2d(std::min(kHighest_m, from_tip.dot(axis_tool)), from_tip.dot(*shape.sharp_side_tool));
    };
    corners_m = {at(shape.a_tool_m), at(shape.c_tool_m), at(shape.d_tool_m), at(shape.b_tool_m)};
  }
  bool holds(const Vec3& from_tip) const {
    const Eigen::Vector2d p(from_tip.dot(axis), from_tip.dot(ahead));
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector2d from = corners_m[i], side = corners_m[(i + 1) % 4] - from;
      const double length = side.norm();
      if (length > 0 && (side.x() * (p - from).y() - side.y() * (p - from).x()) / length > kOver_m) return false;
    }
    return true;
  }
  // Lines across the flat, from its back to its front.
  void lines(std::vector<Vec3>& points, std::vector<std::array<std::size_t, 2>>& segments) const {
    const double highest_m = corners_m[3].x();
    for (double height_m = 0; height_m <= highest_m; height_m += kSpacing_m) {
      double front_m = 0;
      for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector2d from = corners_m[i], to = corners_m[i + 1];
        if (height_m < std::min(from.x(), to.x()) || height_m > std::max(from.x(), to.x()) || from.x() == to.x())
          continue;
        front_m = std::max(front_m, from.y() + (height_m - from.x()) / (to.x() - from.x()) * (to.y() - from.y()));
      }
      segments.push_back({points.size(), points.size() + 1});
      points.push_back(tip_world_m + height_m * axis);
      points.push_back(tip_world_m + height_m * axis + front_m * ahead);
    }
  }
};

}  // namespace

std::vector<PointConstraint> BladeSides::press(Body& body, const InstrumentEdge& edge, const Vec3& way_world_m) {
  const int pressed = std::exchange(presses_, 0);
  if (!edge.shape().sharp_side_tool || !edge.kind().tip_pierces) return {};
  const Flat flat(edge);
  const SurfaceView view = body.view();
  const double way_aside_m = way_world_m.dot(flat.aside);
  const double near_m = kAtMost_m + 2 * std::abs(way_aside_m);
  std::vector<Vec3> points;
  std::vector<std::array<std::size_t, 2>> segments;
  flat.lines(points, segments);
  std::vector<TriangleId> near;
  body.tree().near_segments(view, points, segments,
                            std::max(pressed != 0 ? kDeepest_m : 0, near_m) + kFree_m + kSpacing_m / 2, near);
  const ContactLayer layer(body, kGives_m);
  std::vector<PointConstraint> held;
  double deepest_m = kPresses_m;
  bool is_between_walls = false;
  for (const TriangleId t : near) {
    const Triangle& triangle = view.mesh.triangle(t);
    if (triangle.surface != Surface::wall) continue;
    const double faces = view.normal(t).dot(flat.aside);
    if (std::abs(faces) < kAlongFlat) continue;
    const Corners c = view.corners(t);
    const std::array<Vec3, 3> rest_m{view.mesh.rest_body_m(triangle.v[0]), view.mesh.rest_body_m(triangle.v[1]),
                                     view.mesh.rest_body_m(triangle.v[2])};
    const double longest_m =
        std::max({(rest_m[1] - rest_m[0]).norm(), (rest_m[2] - rest_m[1]).norm(), (rest_m[0] - rest_m[2]).norm()});
    const int along = std::clamp(static_cast<int>(std::ceil(longest_m / kSpacing_m)), 1, kMostInEdge);
    const double area_m2 = 0.5 * (rest_m[1] - rest_m[0]).cross(rest_m[2] - rest_m[0]).norm() / (along * along);
    if (!(area_m2 > 0)) continue;
    const int side = faces > 0 ? -1 : 1;
    const Vec3 outwards = -side * flat.aside;
    const double most_m = side == pressed ? std::max(kDeepest_m, near_m) : near_m;
    for_lattice(along, [&](const Vec3& bary) {
      const Vec3 at = bary.x() * c[0] + bary.y() * c[1] + bary.z() * c[2], from_tip = at - flat.tip_world_m;
      const double depth_m = from_tip.dot(outwards) - kFree_m;
      if (depth_m < -kBesideFlat_m || depth_m > most_m || !flat.holds(from_tip)) return;
      is_between_walls = true;
      if (depth_m <= 0) return;
      if (depth_m > deepest_m) deepest_m = depth_m, presses_ = side;
      PointConstraint held_there;
      held_there.v = triangle.v;
      held_there.w = {bary.x(), bary.y(), bary.z()};
      held_there.target_world_m = at - depth_m * outwards;
      held_there.normal = outwards;
      held_there.unilateral = true;
      layer.put_under(held_there, area_m2);
      held.push_back(held_there);
    });
  }
  aside_m_ = presses_ != 0 || !is_between_walls ? aside_m_ + way_aside_m : 0;
  return held;
}

}  // namespace sectio

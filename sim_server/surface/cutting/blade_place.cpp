#include "sim_server/surface/cutting/blade_place.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>
#include <vector>

#include "common/core/sort_unique.h"
#include "common/math/intersect.h"

namespace sectio {
namespace {

constexpr double kAboveHeel_m = 2e-3, kBelowTip_m = 3e-4;
constexpr double kLongestLine_m = 0.05;  // a blade without an end
constexpr double kNear_m = 0.015;        // from a blade's line to the corners of a lid that it may enter
constexpr double kReachEdges = 2.5;      // the skin by which a place is mapped reaches so far, in edges
constexpr double kLeastPivot = 1e-3;
constexpr double kSame_m = 1e-9;

double distance_to_line_m(const BladeLine& line, const Vec3& x) {
  return distance_to_segment(x, line.heel_world_m, line.tip_world_m);
}

// The skin around a triangle that can be reached within a distance, and not over a rim.
std::vector<TriangleId> skin_around(const MeshDraft& draft, TriangleId middle, const Vec3& rest_body_m,
                                    double reach_m) {
  const Vec3 normal = rest_normal_of(draft, draft.triangle(middle).v);
  const auto is_far = [&](VertexId v) { return (draft.rest(v) - rest_body_m).norm() > reach_m; };
  std::vector<TriangleId> around{middle};
  for (std::size_t i = 0; i < around.size(); ++i)
    for (int edge = 0; edge < 3; ++edge) {
      const TriangleId t = draft.neighbour(around[i], edge);
      if (t == kNone || std::ranges::find(around, t) != around.end()) continue;
      const Triangle triangle = draft.triangle(t);
      if (!triangle.alive() || triangle.surface != Surface::skin || std::ranges::all_of(triangle.v, is_far) ||
          rest_normal_of(draft, triangle.v).dot(normal) < kCosRim)
        continue;
      around.push_back(t);
    }
  return around;
}

double mean_edge_m(const MeshDraft& draft, TriangleId t) {
  double sum_m = 0;
  int edges = 0;
  for (const VertexId v : draft.triangle(t).v)
    for (const TriangleId around : draft.fan(v)) {
      const Triangle triangle = draft.triangle(around);
      if (triangle.surface != Surface::skin) continue;
      for (std::size_t i = 0; i < 3; ++i, ++edges)
        sum_m += (draft.rest(triangle.v[i]) - draft.rest(triangle.v[(i + 1) % 3])).norm();
    }
  return sum_m / edges;
}

// Two unit vectors across a normal, the first as near to a direction as may be.
Eigen::Matrix<double, 3, 2> plane_of(const Vec3& normal, const Vec3& direction) {
  Eigen::Matrix<double, 3, 2> plane;
  plane.col(0) = (direction - direction.dot(normal) * normal).stableNormalized();
  plane.col(1) = normal.cross(plane.col(0));
  return plane;
}

// The place at rest of a point in a triangle, by an affine map of the skin around it. By the map of the triangle alone,
// lips are scalloped at the pitch of the mesh, since neighbours at the end of a cut are stretched differently.
//
// x: positions and X: places at rest, both from the point and in the mean plane of the skin. Least squares of
// X_i = b + G x_i with weights (1 - r^2/R^2)^2, r from the point at rest; b is what the triangle is off.
void smooth(const MeshDraft& draft, BladePlace& place) {
  if (draft.triangle(place.triangle).surface != Surface::skin) return;
  const double reach_m = kReachEdges * mean_edge_m(draft, place.triangle);
  const auto around = skin_around(draft, place.triangle, place.rest_body_m, reach_m);
  std::vector<VertexId> vertices;
  Vec3 normal_rest = Vec3::Zero(), normal_world = Vec3::Zero();
  for (const TriangleId t : around) {
    const auto v = draft.triangle(t).v;
    normal_rest += (draft.rest(v[1]) - draft.rest(v[0])).cross(draft.rest(v[2]) - draft.rest(v[0]));
    normal_world += (draft.position(v[1]) - draft.position(v[0])).cross(draft.position(v[2]) - draft.position(v[0]));
    vertices.insert(vertices.end(), v.begin(), v.end());
  }
  sort_unique(vertices);
  const auto v = draft.triangle(place.triangle).v;
  const auto rest = plane_of(normal_rest.stableNormalized(), draft.rest(v[1]) - draft.rest(v[0]));
  const auto world = plane_of(normal_world.stableNormalized(), draft.position(v[1]) - draft.position(v[0]));
  Mat3 squares = Mat3::Zero();
  Eigen::Matrix<double, 3, 2> right = Eigen::Matrix<double, 3, 2>::Zero();
  for (const VertexId vertex : vertices) {
    const Vec3 from_rest_m = draft.rest(vertex) - place.rest_body_m;
    const double near = 1 - from_rest_m.squaredNorm() / (reach_m * reach_m);
    if (near <= 0) continue;
    Vec3 row(1, 0, 0);
    row.tail<2>() = world.transpose() * (draft.position(vertex) - place.point_world_m) / reach_m;
    squares += near * near * row * row.transpose();
    right += near * near * row * (rest.transpose() * from_rest_m).transpose();
  }
  const Eigen::LDLT<Mat3> solver(squares);
  if (solver.info() != Eigen::Success || !(solver.vectorD().minCoeff() >= kLeastPivot)) return;
  const Eigen::Vector2d off_m = solver.solve(right).row(0).transpose();
  if (off_m.norm() < kSame_m) return;  // nothing is stretched: the point stays bit for bit
  const Vec3 smooth_m = place.rest_body_m + rest * off_m;
  double least_m2 = std::numeric_limits<double>::max();
  for (const TriangleId t : around) {
    const auto c = draft.triangle(t).v;
    const auto closest = closest_on_triangle(smooth_m, {draft.rest(c[0]), draft.rest(c[1]), draft.rest(c[2])});
    if (closest.squared_distance >= least_m2) continue;
    least_m2 = closest.squared_distance;
    place.triangle = t;
    place.bary = closest.bary;
    place.rest_body_m = closest.point;
  }
}

BladePlace place_in_triangle(const MeshDraft& draft, TriangleId t, const Vec3& bary) {
  const auto v = draft.triangle(t).v;
  BladePlace place;
  place.triangle = t;
  place.bary = bary;
  const VertexState at = VertexState::mix({draft.state(v[0]), draft.state(v[1]), draft.state(v[2])}, bary);
  place.rest_body_m = at.rest_body_m;
  place.point_world_m = at.position_world_m;
  return place;
}

}  // namespace

BladePlace place_on_skin(const MeshDraft& draft, TriangleId triangle, const Vec3& bary) {
  BladePlace place = place_in_triangle(draft, triangle, bary);
  smooth(draft, place);
  return place;
}

BladeLine line_of(const Blade& blade) {
  const double length_m = std::min(blade.length_m, kLongestLine_m);
  return {blade.tip_world_m + (length_m + kAboveHeel_m) * blade.up_world,
          blade.tip_world_m - kBelowTip_m * blade.up_world};
}

std::optional<BladePlace> place_on_skin(const MeshDraft& draft, std::span<const TriangleId> triangles,
                                        const Blade& blade) {
  const BladeLine line = line_of(blade);
  std::optional<BladePlace> place;
  double first = 2;
  for (const TriangleId t : triangles) {
    const Triangle triangle = draft.triangle(t);
    if (!triangle.alive() || triangle.surface != Surface::skin) continue;
    const auto& v = triangle.v;
    const auto hit = cross_segment(line.heel_world_m, line.tip_world_m,
                                   {draft.position(v[0]), draft.position(v[1]), draft.position(v[2])});
    if (!hit || !hit->entering || hit->parameter >= first) continue;
    first = hit->parameter;
    place = place_in_triangle(draft, t, hit->bary);
  }
  if (place) smooth(draft, *place);
  return place;
}

std::optional<BladePlace> place_on_lid(const MeshDraft& draft, const Grooves& grooves, const Blade& blade) {
  const BladeLine line = line_of(blade);
  std::optional<BladePlace> place;
  double first = 2;
  const auto ask = [&](const Lid& lid, VertexId a, VertexId b, VertexId c) {
    if (a == b || b == c || c == a) return;
    const auto hit =
        cross_segment(line.heel_world_m, line.tip_world_m, {draft.position(a), draft.position(b), draft.position(c)});
    if (!hit || !hit->entering || hit->parameter >= first) return;
    first = hit->parameter;
    place = {BladePlace::On::lid, kNone, hit->bary, lid, Vec3::Zero(), hit->point};
    place->rest_body_m = hit->bary[0] * draft.rest(a) + hit->bary[1] * draft.rest(b) + hit->bary[2] * draft.rest(c);
  };
  for (const Rung& rung : grooves.rungs) {
    if (distance_to_line_m(line, draft.position(rung.lip)) > kNear_m) continue;
    const auto lip = lip_from(draft, rung.lip);
    const auto lid = lip ? lid_of(draft, grooves, *lip) : std::nullopt;
    if (!lid) continue;
    ask(*lid, lid->lip.to, lid->lip.from, lid->opposite.to);
    ask(*lid, lid->lip.to, lid->opposite.to, lid->opposite.from);
    for (const auto& joint : joints_of(draft, grooves, rung.lip))
      for (std::size_t i = 1; i + 1 < joint.size(); ++i) ask(*lid, joint[0], joint[i], joint[i + 1]);
  }
  return place;
}

}  // namespace sectio

#include "sim_server/body_contact/find_lips.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/math/intersect.h"

namespace sectio {
namespace {

constexpr double kApartAtRest_m = 0.001;  // walls further from each other are not of one cut
constexpr double kBehindAtRest_m = 1e-4;  // walls with tissue of this thickness between them are not of one cut
constexpr double kReach_m = 1e-4;         // a gap that counts as contact
constexpr double kDeepest_m = 0.004;      // a deeper vertex is not behind this lip
constexpr double kFast_m_per_s = 0.5;     // lips meet more slowly
constexpr double kLongestPause = 8;       // steps
constexpr double kFacing = -0.5;          // cosine of the angle between walls that face each other

Corners corners_at_rest(const TriangleMesh& mesh, TriangleId t) {
  const auto& v = mesh.triangle(t).v;
  return {mesh.rest_body_m(v[0]), mesh.rest_body_m(v[1]), mesh.rest_body_m(v[2])};
}
Vec3 area_of(const Corners& c) {
  return (c[1] - c[0]).cross(c[2] - c[0]);
}
bool has_corner(const Triangle& t, VertexId v) {
  return std::ranges::find(t.v, v) != t.v.end();
}

Corners corners_now(const SharedBody& body, TriangleId t) {
  const ParticleView now = body.particles.view();
  const auto& v = body.mesh.triangle(t).v;
  return {now.position(v[0]), now.position(v[1]), now.position(v[2])};
}
// Whether a triangle that was opposite to a vertex, or may be, is a wall still, and another one than the vertex's own.
bool is_opposite(const TriangleMesh& mesh, VertexId v, TriangleId t) {
  return t != kNone && is_wall(mesh, t) && !has_corner(mesh.triangle(t), v);
}

// The normals of the walls at a vertex, at rest. In a ridge none of the walls faces as their mean does.
std::vector<Vec3> wall_normals(const TriangleMesh& mesh, VertexId v) {
  std::vector<Vec3> normals;
  for (const TriangleId t : mesh.fan(v))
    if (is_wall(mesh, t)) normals.push_back(area_of(corners_at_rest(mesh, t)).stableNormalized());
  return normals;
}

// Whether a place at rest, of walls with these normals, is before these corners, which face one of them.
bool is_before(const Corners& c, const Vec3& at_rest, std::span<const Vec3> normals) {
  const Vec3 facing = area_of(c).stableNormalized();
  const double before_m = (at_rest - c[0]).dot(facing);
  return before_m > -kBehindAtRest_m && before_m < kApartAtRest_m &&
         std::ranges::any_of(normals, [&](const Vec3& normal) { return normal.dot(facing) < kFacing; });
}

}  // namespace

void LipFinder::follow(const TriangleMesh& mesh, std::span<const VertexId> changed) {
  seen_.resize(mesh.triangle_slots(), 0);
  ++round_;
  for (const VertexId v : changed) {
    const bool lives = v < mesh.vertex_slots() && mesh.vertex_alive(v);
    bool at_wall = false;
    if (lives)
      for (const TriangleId t : mesh.fan(v)) {
        if (!is_wall(mesh, t)) continue;
        at_wall = true;
        if (std::exchange(seen_[t], round_) != round_) walls_.add(mesh, t);
      }
    if (!at_wall) {
      lips_.erase(v);
      continue;
    }
    Lip& lip = lips_.try_emplace(v).first->second;
    lip.opposite.fill(kNone);
    if (!std::exchange(lip.waits, true)) waiting_.push_back(v);
  }
}

void LipFinder::search(const SharedBody& body) {
  for (int i = 0; i < kSearches; ++i) {
    VertexId v = kNone;
    while (!waiting_.empty() && v == kNone) {
      if (lips_.contains(waiting_.front())) v = waiting_.front();
      waiting_.pop_front();
    }
    if (v == kNone) {
      if (i > 0) return;  // one vertex of the round a step
      auto it = lips_.lower_bound(next_);
      if (it == lips_.end()) it = lips_.begin();
      if (it == lips_.end()) return;
      v = it->first;
      next_ = v + 1;
    }
    Lip& lip = lips_.at(v);
    lip.waits = false;
    lip.pause = 0;
    search_opposite(body, v, lip);
  }
}

// The walls that are nearest at rest, and the one to which the vertex has slid.
void LipFinder::search_opposite(const SharedBody& body, VertexId v, Lip& lip) {
  const TriangleMesh& mesh = body.mesh;
  const Vec3& at = mesh.rest_body_m(v);
  const std::vector<Vec3> normals = wall_normals(mesh, v);
  seen_.resize(mesh.triangle_slots(), 0);
  ++round_;
  using Found = std::pair<double, TriangleId>;
  std::vector<Found> found;
  walls_.near(mesh, at, [&](TriangleId t) {
    if (std::exchange(seen_[t], round_) == round_) return;
    const Corners c = corners_at_rest(mesh, t);
    if (has_corner(mesh.triangle(t), v) || !is_before(c, at, normals)) return;
    const double away = closest_on_triangle(at, c).squared_distance;
    if (away < kAside_m * kAside_m) found.emplace_back(away, t);
  });
  std::ranges::sort(found);
  found.resize(std::min(found.size(), kOpposite));
  const TriangleId slid_to = nearest_opposite(body, v, lip).triangle;
  if (slid_to != kNone && std::ranges::find(found, slid_to, &Found::second) == found.end() &&
      is_before(corners_at_rest(mesh, slid_to), at, normals)) {
    if (found.size() == kOpposite) found.pop_back();
    found.emplace_back(0, slid_to);
  }
  lip.opposite.fill(kNone);
  for (std::size_t i = 0; i < found.size(); ++i) lip.opposite[i] = found[i].second;
}

// The nearest of a vertex's opposite triangles.
LipFinder::Opposite LipFinder::nearest_opposite(const SharedBody& body, VertexId v, const Lip& lip) {
  const Vec3 at = body.particles.view().position(v);
  Opposite on;
  double nearest = kDeepest_m * kDeepest_m;
  for (const TriangleId t : lip.opposite) {
    if (!is_opposite(body.mesh, v, t)) continue;
    const Corners corners = corners_now(body, t);
    const ClosestPoint closest = closest_on_triangle(at, corners);
    if (closest.squared_distance >= nearest) continue;
    nearest = closest.squared_distance;
    on = {t, closest.bary, at - closest.point, area_of(corners).stableNormalized()};
  }
  return on;
}

// A vertex that has slid past the border of its nearest wall goes on to the neighbour that is nearer, which takes the
// place of the furthest wall.
void LipFinder::slide(const SharedBody& body, VertexId v, const Opposite& on, Lip& lip) {
  const Vec3 at = body.particles.view().position(v);
  const std::vector<Vec3> normals = wall_normals(body.mesh, v);
  const auto squared_distance = [&](TriangleId t) {
    return closest_on_triangle(at, corners_now(body, t)).squared_distance;
  };
  const auto order = [&](TriangleId t) {
    return is_opposite(body.mesh, v, t) ? squared_distance(t) : std::numeric_limits<double>::infinity();
  };
  for (const TriangleId t : body.mesh.neighbours(on.triangle)) {
    if (std::ranges::find(lip.opposite, t) != lip.opposite.end() || order(t) >= on.away_m.squaredNorm()) continue;
    if (is_before(corners_at_rest(body.mesh, t), body.mesh.rest_body_m(v), normals))
      *std::ranges::max_element(lip.opposite, {}, order) = t;
  }
}

// Makes a contact with the nearest of the opposite triangles that the vertex is over or under.
void LipFinder::find_contact(const SharedBody& body, VertexId v, Lip& lip, double step_s,
                             std::vector<BodyContact>& contacts) {
  if (lip.pause > 0) return void(--lip.pause);
  const Opposite on = nearest_opposite(body, v, lip);
  const double nearest_m = on.triangle == kNone ? kDeepest_m : on.away_m.norm(), above_m = on.away_m.dot(on.facing);
  const bool is_away = on.triangle == kNone || above_m > kReach_m, is_beside = std::abs(above_m) < 0.7 * nearest_m;
  if (is_away || is_beside)  // others are behind the lip, and are pushed in each step
    lip.pause = static_cast<std::uint8_t>(std::min(kLongestPause, nearest_m / (kFast_m_per_s * step_s)));
  if (is_away) return;
  if (is_beside) return slide(body, v, on, lip);
  const Corners rest = corners_at_rest(body.mesh, on.triangle);
  const Vec3 rest_point = on.bary[0] * rest[0] + on.bary[1] * rest[1] + on.bary[2] * rest[2];
  const double at_rest_m = (body.mesh.rest_body_m(v) - rest_point).dot(area_of(rest).stableNormalized());

  BodyContact contact;
  contact.point_world_m = body.particles.view().position(v);
  contact.normal_world = on.facing;
  contact.friction = 0;  // lips are wet
  contact.depth_m = std::min(0.0, at_rest_m) - above_m;
  contact.one = side_at(0, v);
  contact.other = {0, body.mesh.triangle(on.triangle).v, on.bary};
  contacts.push_back(contact);
}

void LipFinder::find(const SharedBody& body, double step_s, std::vector<BodyContact>& contacts) {
  if (lips_.empty()) return;
  search(body);
  for (auto& [v, lip] : lips_) find_contact(body, v, lip, step_s, contacts);
}

}  // namespace sectio

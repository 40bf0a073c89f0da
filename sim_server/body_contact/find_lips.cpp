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

// The mean normal of the walls at a vertex, at rest.
Vec3 wall_normal(const TriangleMesh& mesh, VertexId v) {
  Vec3 area = Vec3::Zero();
  for (const TriangleId t : mesh.fan(v))
    if (is_wall(mesh, t)) area += area_of(corners_at_rest(mesh, t));
  return area.stableNormalized();
}

// Whether a place at rest, of a wall with this normal, is before these corners, which face it.
bool is_before(const Corners& c, const Vec3& at_rest, const Vec3& normal) {
  const Vec3 facing = area_of(c).stableNormalized();
  const double before_m = (at_rest - c[0]).dot(facing);
  return normal.dot(facing) < kFacing && before_m > -kBehindAtRest_m && before_m < kApartAtRest_m;
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

void LipFinder::search(const TriangleMesh& mesh) {
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
    search_opposite(mesh, v, lip);
  }
}

void LipFinder::search_opposite(const TriangleMesh& mesh, VertexId v, Lip& lip) {
  const Vec3& at = mesh.rest_body_m(v);
  const Vec3 normal = wall_normal(mesh, v);
  seen_.resize(mesh.triangle_slots(), 0);
  ++round_;
  std::vector<std::pair<double, TriangleId>> found;
  walls_.near(mesh, at, [&](TriangleId t) {
    if (std::exchange(seen_[t], round_) == round_) return;
    const Corners c = corners_at_rest(mesh, t);
    if (has_corner(mesh.triangle(t), v) || !is_before(c, at, normal)) return;
    const double away = closest_on_triangle(at, c).squared_distance;
    if (away < kAside_m * kAside_m) found.emplace_back(away, t);
  });
  std::ranges::sort(found);
  lip.opposite.fill(kNone);
  for (std::size_t i = 0; i < std::min(found.size(), kOpposite); ++i) lip.opposite[i] = found[i].second;
}

// A vertex that has slid past the border of its nearest wall goes on to the neighbour that is nearer, which takes the
// place of the furthest wall.
void LipFinder::slide(const SharedBody& body, VertexId v, TriangleId on, double nearest, Lip& lip) {
  const Vec3 at = body.particles.view().position(v), normal = wall_normal(body.mesh, v);
  const auto squared_distance = [&](TriangleId t) {
    return closest_on_triangle(at, corners_now(body, t)).squared_distance;
  };
  const auto order = [&](TriangleId t) {
    return is_opposite(body.mesh, v, t) ? squared_distance(t) : std::numeric_limits<double>::infinity();
  };
  for (const TriangleId t : body.mesh.neighbours(on)) {
    if (std::ranges::find(lip.opposite, t) != lip.opposite.end() || order(t) >= nearest) continue;
    if (is_before(corners_at_rest(body.mesh, t), body.mesh.rest_body_m(v), normal))
      *std::ranges::max_element(lip.opposite, {}, order) = t;
  }
}

// Makes a contact with the nearest of the opposite triangles that the vertex is over or under.
void LipFinder::find_contact(const SharedBody& body, VertexId v, Lip& lip, double step_s,
                             std::vector<BodyContact>& contacts) {
  if (lip.pause > 0) return void(--lip.pause);
  const Vec3 at = body.particles.view().position(v);
  double nearest = kDeepest_m * kDeepest_m;
  TriangleId on = kNone;
  ClosestPoint best;
  Vec3 facing = Vec3::Zero();
  for (const TriangleId t : lip.opposite) {
    if (!is_opposite(body.mesh, v, t)) continue;
    const Corners corners = corners_now(body, t);
    const ClosestPoint closest = closest_on_triangle(at, corners);
    if (closest.squared_distance >= nearest) continue;
    nearest = closest.squared_distance;
    best = closest;
    facing = area_of(corners).stableNormalized();
    on = t;
  }
  lip.pause = static_cast<std::uint8_t>(std::min(kLongestPause, std::sqrt(nearest) / (kFast_m_per_s * step_s)));
  if (on == kNone) return;
  const Vec3 away = at - best.point;
  const double above_m = away.dot(facing);
  if (above_m > kReach_m) return;
  if (std::abs(above_m) < 0.7 * away.norm()) return slide(body, v, on, nearest, lip);  // beside the triangle
  const Corners rest = corners_at_rest(body.mesh, on);
  const Vec3 rest_point = best.bary[0] * rest[0] + best.bary[1] * rest[1] + best.bary[2] * rest[2];
  const double at_rest_m = (body.mesh.rest_body_m(v) - rest_point).dot(area_of(rest).stableNormalized());

  BodyContact contact;
  contact.point_world_m = at;
  contact.normal_world = facing;
  contact.friction = 0;  // lips are wet
  contact.depth_m = std::min(0.0, at_rest_m) - above_m;
  contact.one = side_at(0, v);
  contact.other = {0, body.mesh.triangle(on).v, best.bary};
  contacts.push_back(contact);
}

void LipFinder::find(const SharedBody& body, double step_s, std::vector<BodyContact>& contacts) {
  if (lips_.empty()) return;
  search(body.mesh);
  for (auto& [v, lip] : lips_) find_contact(body, v, lip, step_s, contacts);
}

}  // namespace sectio

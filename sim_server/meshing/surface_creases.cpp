#include "sim_server/meshing/surface_creases.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "common/core/sort_unique.h"
#include "common/math/disjoint_sets.h"

namespace sectio {
namespace {

constexpr double kOnCrease = 1e-6;  // cells; a vertex closer to a crease or to a corner is in its place

using Edge = std::array<VertexId, 2>;

// The triangles on the two sides of each edge.
std::map<Edge, std::array<std::uint32_t, 2>> sides_of(const TriangleSoup& surface) {
  std::map<Edge, std::array<std::uint32_t, 2>> sides;
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t)
    for (std::size_t i = 0; i < 3; ++i) {
      const auto [a, b] = std::minmax(surface.triangles[t][i], surface.triangles[t][(i + 1) % 3]);
      const auto [at, is_new] = sides.try_emplace({a, b}, std::array{t, kNone});
      if (!is_new) at->second[1] = t;
    }
  return sides;
}

Vec3 normal_m2(const TriangleSoup& surface, std::uint32_t t) {
  const auto& [a, b, c] = surface.triangles[t];
  const auto& x = surface.vertices_body_m;
  return (x[b] - x[a]).cross(x[c] - x[a]) / 2;
}

struct Nearest {
  double on_first = 0, on_second = 0, squared_distance = HUGE_VAL;  // shares of the segments
};
// The points of two segments that are closest to each other.
Nearest nearest(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b) {
  const Vec3 u = q - p, v = b - a, w = p - a;
  const double uu = u.squaredNorm(), uv = u.dot(v), vv = v.squaredNorm(), det = uu * vv - uv * uv;
  double s = det > 1e-12 * uu * vv ? std::clamp((uv * v.dot(w) - vv * u.dot(w)) / det, 0.0, 1.0) : 0.5;
  const double t = vv > 0 ? std::clamp((uv * s + v.dot(w)) / vv, 0.0, 1.0) : 0;
  if (uu > 0) s = std::clamp((uv * t - u.dot(w)) / uu, 0.0, 1.0);
  return {s, t, (w + s * u - t * v).squaredNorm()};
}

}  // namespace

Seat common_faces(const Seat& a, const Seat& b) {
  Seat both;
  std::ranges::set_intersection(a, b, std::back_inserter(both));
  return both;
}

SurfaceCreases::SurfaceCreases(const TriangleSoup& surface, double cell_m)
    : surface_(surface), cell_m_(cell_m), near_(surface, cell_m) {
  find_faces(cell_m * cell_m);
  find_creases();
}

void SurfaceCreases::find_faces(double least_area_m2) {
  DisjointSets faces(surface_.triangles.size());
  const double smooth = std::cos(kSharp_deg * M_PI / 180);
  for (const auto& [edge, t] : sides_of(surface_)) {
    if (t[1] == kNone) continue;
    const Vec3 m = normal_m2(surface_, t[0]), n = normal_m2(surface_, t[1]);
    if (m.dot(n) < smooth * m.norm() * n.norm()) continue;
    faces.join(t[0], t[1]);
  }
  std::vector<double> area_m2(surface_.triangles.size(), 0);
  for (std::uint32_t t = 0; t < area_m2.size(); ++t) area_m2[faces.root(t)] += normal_m2(surface_, t).norm();
  for (std::uint32_t t = 0; t < area_m2.size(); ++t)
    face_.push_back(area_m2[faces.root(t)] < least_area_m2 ? kNone : faces.root(t));
}

void SurfaceCreases::find_creases() {
  std::map<VertexId, Seat> faces;
  for (const auto& [edge, t] : sides_of(surface_)) {
    if (t[1] == kNone) continue;
    const auto [a, b] = std::minmax(face_[t[0]], face_[t[1]]);
    if (a == b || b == kNone) continue;
    creases_[{a, b}].push_back(edge);
    for (const VertexId v : edge) faces[v].insert(faces[v].end(), {a, b});
  }
  for (auto& [v, seat] : faces) {
    sort_unique(seat);
    if (seat.size() > 2) corners_.emplace(v, seat);
  }
}

SurfaceCreases::Place SurfaceCreases::placed(const Segment& s, double share, const Seat& faces) const {
  const auto& x = surface_.vertices_body_m;
  const Vec3 along = x[s[1]] - x[s[0]], point = x[s[0]] + share * along;
  for (const VertexId v : s) {
    const auto corner = corners_.find(v);
    if (corner != corners_.end() && (point - x[v]).norm() < kOnCrease * cell_m_) return {x[v], corner->second};
  }
  return {point, faces};
}

Seat SurfaceCreases::seat_of(const Vec3& p) const {
  const std::uint32_t triangle = near_.closest(p, [](std::uint32_t) { return true; }).triangle;
  if (triangle == kNone || face_[triangle] == kNone) return {};
  const std::uint32_t face = face_[triangle];
  for (const auto& [faces, segments] : creases_) {
    if (!std::ranges::binary_search(faces, face)) continue;
    for (const Segment& s : segments) {
      const Nearest n = nearest(p, p, surface_.vertices_body_m[s[0]], surface_.vertices_body_m[s[1]]);
      if (n.squared_distance < std::pow(kOnCrease * cell_m_, 2)) return placed(s, n.on_second, faces).seat;
    }
  }
  return {face};
}

Vec3 SurfaceCreases::closest(const Vec3& p, const Seat& seat) const {
  if (seat.empty()) return near_.closest(p);
  if (seat.size() == 1) return near_.closest(p, [&](std::uint32_t t) { return face_[t] == seat[0]; }).point;
  const std::optional<Place> place = seat.size() == 2 ? between(p, {seat[0]}, p, {seat[1]}) : corner_of(p, seat);
  return place ? place->point : p;
}

std::optional<SurfaceCreases::Place> SurfaceCreases::between(const Vec3& p, const Seat& a, const Vec3& q,
                                                             const Seat& b) const {
  std::optional<Place> best;
  double squared = HUGE_VAL;
  for (const std::uint32_t one : a)
    for (const std::uint32_t other : b) {
      const auto [low, high] = std::minmax(one, other);
      const auto crease = creases_.find({low, high});
      if (crease == creases_.end()) continue;
      for (const Segment& s : crease->second) {
        const Nearest n = nearest(p, q, surface_.vertices_body_m[s[0]], surface_.vertices_body_m[s[1]]);
        if (!(n.squared_distance < squared)) continue;
        squared = n.squared_distance;
        best = placed(s, n.on_second, crease->first);
      }
    }
  return best;
}

std::optional<SurfaceCreases::Place> SurfaceCreases::corner_of(const Vec3& p, const Seat& faces) const {
  std::optional<Place> best;
  double squared = HUGE_VAL;
  for (const auto& [v, seat] : corners_) {
    const Vec3& at = surface_.vertices_body_m[v];
    if (!std::ranges::includes(seat, faces) || !((at - p).squaredNorm() < squared)) continue;
    squared = (at - p).squaredNorm();
    best = {at, seat};
  }
  return best;
}

}  // namespace sectio

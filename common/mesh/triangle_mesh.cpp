#include "common/mesh/triangle_mesh.h"

#include <algorithm>

#include "common/core/error.h"
#include "common/math/hash.h"
#include "common/mesh/check.h"
#include "common/mesh/slot_table.h"

namespace sectio {

std::uint64_t vertex_hash(VertexId v, const Vec3& rest_body_m) {
  std::uint64_t h = mix64(0x7665727465780000ULL + v);
  for (int i = 0; i < 3; ++i) h = hash_combine(h, rest_body_m[i]);
  return h;
}

std::uint64_t triangle_hash(TriangleId t, const Triangle& triangle) {
  std::uint64_t h = mix64(0x747269616e000000ULL + t);
  for (const VertexId v : triangle.v) h = hash_combine(h, std::uint64_t{v});
  return hash_combine(h, static_cast<std::uint64_t>(triangle.surface));
}

std::uint64_t slots_hash(std::uint32_t vertex_slots, std::uint32_t triangle_slots) {
  return hash_combine(mix64(vertex_slots), std::uint64_t{triangle_slots});
}

TriangleMesh::TriangleMesh(const TriangleSoup& soup) {
  const SurfaceReport report = check_soup(soup);
  if (!report.valid()) throw InputError(report.first_defect);
  rest_ = soup.vertices_body_m;
  triangles_.reserve(with_room(soup.triangles.size()));
  for (const auto& v : soup.triangles) triangles_.push_back({v, Surface::skin});
  incident_.assign(rest_.size(), 0);
  rebuild_derived();
  permanent_hash_ = hash_;
  if (!free_vertices_.empty())
    throw InputError("vertex " + std::to_string(free_vertices_.front()) + " belongs to no triangle");
}

TriangleMesh::TriangleMesh(std::vector<Vec3> rest_body_m, std::vector<std::uint8_t> vertex_alive,
                           std::vector<Triangle> triangles, std::uint64_t revision,
                           std::optional<std::uint64_t> permanent_hash)
    : rest_(std::move(rest_body_m)), triangles_(std::move(triangles)), revision_(revision) {
  if (vertex_alive.size() != rest_.size()) throw InputError("keyframe: sizes of vertex arrays differ");
  for (const Triangle& t : triangles_)
    for (const VertexId v : t.v)
      if (t.alive() && (v >= rest_.size() || !vertex_alive[v])) throw InputError("keyframe: triangle without vertex");
  rebuild_derived();
  permanent_hash_ = permanent_hash.value_or(hash_);
  for (VertexId v = 0; v < rest_.size(); ++v)
    if (vertex_alive[v] != (incident_[v] != kNone)) throw InputError("keyframe: vertex without triangle");
  const SurfaceReport report = check(*this);
  if (!report.valid()) throw InputError("keyframe: " + report.first_defect);
}

void TriangleMesh::rebuild_derived() {
  struct HalfEdge {
    VertexId low, high;
    TriangleId triangle;
    int edge;
  };
  std::vector<HalfEdge> edges;
  edges.reserve(triangles_.size() * 3);
  rest_.reserve(with_room(rest_.size()));
  incident_.reserve(with_room(rest_.size()));
  triangles_.reserve(with_room(triangles_.size()));
  neighbours_.reserve(with_room(triangles_.size()));
  incident_.assign(rest_.size(), kNone);
  neighbours_.assign(triangles_.size(), {kNone, kNone, kNone});
  free_vertices_.clear();
  free_triangles_.clear();
  hash_ = slots_hash(vertex_slots(), triangle_slots());
  for (TriangleId t = 0; t < triangles_.size(); ++t) {
    const Triangle& triangle = triangles_[t];
    if (!triangle.alive()) {
      free_triangles_.push_back(t);
      continue;
    }
    hash_ += triangle_hash(t, triangle);
    for (int i = 0; i < 3; ++i) {
      const VertexId a = triangle.v[static_cast<std::size_t>(i)], b = triangle.v[static_cast<std::size_t>((i + 1) % 3)];
      edges.push_back({std::min(a, b), std::max(a, b), t, i});
      incident_[a] = t;
    }
  }
  std::sort(edges.begin(), edges.end(), [](const HalfEdge& a, const HalfEdge& b) {
    return a.low != b.low ? a.low < b.low : a.high != b.high ? a.high < b.high : a.triangle < b.triangle;
  });
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
    const HalfEdge &a = edges[i], &b = edges[i + 1];
    if (a.low != b.low || a.high != b.high) continue;
    neighbours_[a.triangle][static_cast<std::size_t>(a.edge)] = b.triangle;
    neighbours_[b.triangle][static_cast<std::size_t>(b.edge)] = a.triangle;
  }
  for (VertexId v = 0; v < rest_.size(); ++v) {
    if (incident_[v] == kNone)
      free_vertices_.push_back(v);
    else
      hash_ += vertex_hash(v, rest_[v]);
  }
}

std::size_t TriangleMesh::bytes() const {
  const auto held = [](const auto& list) { return list.capacity() * sizeof(list[0]); };
  return held(rest_) + held(triangles_) + held(neighbours_) + held(incident_) + held(free_vertices_) +
         held(free_triangles_);
}

bool TriangleMesh::same_database(const TriangleMesh& other) const {
  if (rest_.size() != other.rest_.size() || triangles_ != other.triangles_ || hash_ != other.hash_ ||
      free_vertices_ != other.free_vertices_ || free_triangles_ != other.free_triangles_)
    return false;
  for (VertexId v = 0; v < rest_.size(); ++v)
    if (vertex_alive(v) && rest_[v] != other.rest_[v]) return false;
  return true;
}

}  // namespace sectio

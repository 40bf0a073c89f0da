#include "sim_server/tet_cutting/tet_topology.h"

#include <algorithm>

#include "common/core/error.h"

namespace sectio {
namespace {

void replace(Tetrahedron& t, VertexId from, VertexId to) {
  *std::ranges::find(t, from) = to;
}
bool has(const Tetrahedron& t, VertexId v) {
  return std::ranges::find(t, v) != t.end();
}

}  // namespace

TetTopology::TetTopology(const TetMesh& mesh) : tets_(mesh.tetrahedra), star_(mesh.vertices_body_m.size()) {
  for (const Vec3& x : mesh.vertices_body_m) vertices_.push_back({x, x, Vec3::Zero()});
  for (std::uint32_t t = 0; t < tets_.size(); ++t)
    for (const VertexId v : tets_[t]) star_[v].push_back(t);
}

void TetTopology::set_state(VertexId v, const Vec3& position_world_m, const Vec3& velocity_m_per_s) {
  vertices_[v].position_world_m = position_world_m;
  vertices_[v].velocity_m_per_s = velocity_m_per_s;
}

TetMesh TetTopology::mesh() const {
  TetMesh mesh;
  for (const TetVertexState& v : vertices_) mesh.vertices_body_m.push_back(v.rest_body_m);
  mesh.tetrahedra = tets_;
  return mesh;
}

VertexId TetTopology::split(VertexId a, VertexId b, double t) {
  SECTIO_ASSERT(t > 0 && t < 1, "an edge is split between its ends");
  const auto n = static_cast<VertexId>(vertices_.size());
  const TetVertexState &from = vertices_[a], &to = vertices_[b];
  const auto between = [t](const Vec3& p, const Vec3& q) -> Vec3 { return p + t * (q - p); };
  vertices_.push_back({between(from.rest_body_m, to.rest_body_m), between(from.position_world_m, to.position_world_m),
                       between(from.velocity_m_per_s, to.velocity_m_per_s)});
  star_.emplace_back();
  Operation operation{a, b, n, {}, 0};
  for (std::uint32_t& at_b : star_[b]) {
    const std::uint32_t old = at_b;
    if (!has(tets_[old], a)) continue;
    const auto made = static_cast<std::uint32_t>(tets_.size());
    tets_.push_back(tets_[old]);
    replace(tets_[made], a, n);
    replace(tets_[old], b, n);
    at_b = made;
    for (const VertexId v : tets_[made])
      if (v != n && v != b) star_[v].push_back(made);
    star_[n].insert(star_[n].end(), {old, made});
    operation.tets.push_back(old);
    ++operation.added;
  }
  SECTIO_ASSERT(operation.added > 0, "an edge has a tetrahedron");
  journal_.push_back(std::move(operation));
  return n;
}

void TetTopology::undo_split(const Operation& operation) {
  for (std::size_t k = operation.tets.size(); k-- > 0;) {
    const std::uint32_t old = operation.tets[k], made = static_cast<std::uint32_t>(tets_.size() - 1);
    for (const VertexId v : tets_[made])
      if (v != operation.made && v != operation.b) star_[v].pop_back();
    *std::ranges::find(star_[operation.b], made) = old;
    replace(tets_[old], operation.made, operation.b);
    tets_.pop_back();
  }
}

VertexId TetTopology::part(VertexId v, std::span<const std::uint32_t> of) {
  const auto twin = static_cast<VertexId>(vertices_.size());
  vertices_.push_back(TetVertexState(vertices_[v]));
  journal_.push_back({v, kNone, twin, star_[v], 0});
  star_.emplace_back(of.begin(), of.end());
  for (const std::uint32_t t : of) replace(tets_[t], v, twin);
  std::erase_if(star_[v], [&](std::uint32_t t) { return !has(tets_[t], v); });
  SECTIO_ASSERT(!star_[v].empty() && !of.empty(), "both twins have a tetrahedron");
  return twin;
}

double TetTopology::volume_at(VertexId v) const {
  double volume = 0;
  for (const std::uint32_t t : star_[v])
    volume += tet_volume_m3(vertices_[tets_[t][0]].rest_body_m, vertices_[tets_[t][1]].rest_body_m,
                            vertices_[tets_[t][2]].rest_body_m, vertices_[tets_[t][3]].rest_body_m);
  return volume;
}

void TetTopology::undo_part(const Operation& operation) {
  const VertexId v = operation.a, twin = operation.made;
  const double share = volume_at(twin) / (volume_at(twin) + volume_at(v));
  TetVertexState& kept = vertices_[v];
  kept.position_world_m += share * (vertices_[twin].position_world_m - kept.position_world_m);
  kept.velocity_m_per_s += share * (vertices_[twin].velocity_m_per_s - kept.velocity_m_per_s);
  for (const std::uint32_t t : star_[twin]) replace(tets_[t], twin, v);
  star_[v] = operation.tets;
}

std::optional<std::array<VertexId, 2>> TetTopology::made_from(VertexId v) const {
  const std::size_t older = vertices_.size() - journal_.size();  // each operation makes one vertex
  if (v < older) return {};
  const Operation& operation = journal_[v - older];
  return std::array{operation.a, operation.b == kNone ? operation.a : operation.b};
}

void TetTopology::undo_to(std::size_t mark) {
  while (journal_.size() > mark) {
    const Operation& operation = journal_.back();
    SECTIO_ASSERT(operation.made + 1 == vertices_.size(), "operations are undone in reverse order");
    operation.b == kNone ? undo_part(operation) : undo_split(operation);
    vertices_.pop_back();
    star_.pop_back();
    journal_.pop_back();
  }
}

}  // namespace sectio

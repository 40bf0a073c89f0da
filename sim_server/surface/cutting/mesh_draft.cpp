#include "sim_server/surface/cutting/mesh_draft.h"

#include <algorithm>

#include "common/core/error.h"
#include "common/mesh/patch.h"

namespace sectio {

VertexState VertexState::mix(const VertexState& a, const VertexState& b, double s) {
  return {a.rest_body_m + s * (b.rest_body_m - a.rest_body_m),
          a.position_world_m + s * (b.position_world_m - a.position_world_m),
          a.velocity_world_m_per_s + s * (b.velocity_world_m_per_s - a.velocity_world_m_per_s)};
}

VertexState VertexState::mix(const std::array<VertexState, 3>& c, const Vec3& bary) {
  const auto sum = [&](Vec3 VertexState::*field) -> Vec3 {
    return bary[0] * (c[0].*field) + bary[1] * (c[1].*field) + bary[2] * (c[2].*field);
  };
  return {sum(&VertexState::rest_body_m), sum(&VertexState::position_world_m),
          sum(&VertexState::velocity_world_m_per_s)};
}

Triangle MeshDraft::triangle(TriangleId t) const {
  const auto it = triangles_.find(t);
  if (it != triangles_.end()) return it->second.triangle;
  return t < base_->triangle_slots() ? base_->triangle(t) : Triangle{};
}

TriangleId MeshDraft::neighbour(TriangleId t, int i) const {
  const auto it = triangles_.find(t);
  return it != triangles_.end() ? it->second.neighbours[static_cast<std::size_t>(i)] : base_->neighbour(t, i);
}

TriangleId MeshDraft::incident(VertexId v) const {
  const auto it = vertices_.find(v);
  if (it != vertices_.end()) return it->second.incident;
  return v < base_->vertex_slots() ? base_->incident(v) : kNone;
}

VertexState MeshDraft::state(VertexId v) const {
  const auto it = vertices_.find(v);
  if (it != vertices_.end()) return it->second.state;
  return {base_->rest_body_m(v), particles_.position(v), particles_.velocity(v)};
}

Vec3 MeshDraft::rest(VertexId v) const {
  const auto it = vertices_.find(v);
  return it != vertices_.end() ? it->second.state.rest_body_m : base_->rest_body_m(v);
}

std::vector<TriangleId> MeshDraft::fan(VertexId v) const {
  std::vector<TriangleId> result;
  for (const TriangleId t : TriangleFan(*this, v)) result.push_back(t);
  return result;
}

TriangleId MeshDraft::triangle_of_edge(VertexId from, VertexId to) const {
  for (const TriangleId t : fan(from))
    if (triangle(t).after(from) == to) return t;
  return kNone;
}

TriangleId MeshDraft::find_triangle(VertexId a, VertexId b, VertexId c) const {
  const TriangleId t = triangle_of_edge(a, b);
  return t != kNone && triangle(t).before(a) == c ? t : kNone;
}

MeshDraft::TriangleRecord& MeshDraft::edit_triangle(TriangleId t) {
  const auto [it, is_new] = triangles_.try_emplace(t);
  if (is_new && t < base_->triangle_slots()) it->second = {base_->triangle(t), base_->neighbours(t)};
  return it->second;
}

MeshDraft::VertexRecord& MeshDraft::edit_vertex(VertexId v) {
  const auto [it, is_new] = vertices_.try_emplace(v);
  if (is_new && v < base_->vertex_slots())
    it->second = {{base_->rest_body_m(v), particles_.position(v), particles_.velocity(v)}, base_->incident(v), false};
  return it->second;
}

std::uint32_t MeshDraft::take_slot(std::set<std::uint32_t>& freed, std::size_t& cursor,
                                   std::span<const std::uint32_t> base_free, std::uint32_t& slots) {
  const std::uint32_t from_base = cursor < base_free.size() ? base_free[cursor] : kNone;
  if (!freed.empty() && *freed.begin() < from_base) {
    const std::uint32_t slot = *freed.begin();
    freed.erase(freed.begin());
    return slot;
  }
  if (from_base != kNone) {
    ++cursor;
    return from_base;
  }
  return slots++;
}

VertexId MeshDraft::add_vertex(const VertexState& state) {
  const VertexId v = take_slot(freed_vertices_, vertex_cursor_, base_->free_vertices(), vertex_slots_);
  remember(v);
  VertexRecord& record = edit_vertex(v);
  record.incident = kNone;
  if (v < base_->vertex_slots() && base_->vertex_alive(v) && base_->rest_body_m(v) == state.rest_body_m) {
    record.state = {state.rest_body_m, particles_.position(v), particles_.velocity(v)};
    record.set = false;
  } else {
    record.state = state;
    record.set = true;
  }
  return v;
}

void MeshDraft::move_vertex(VertexId v, const VertexState& state) {
  remember(v);
  VertexRecord& record = edit_vertex(v);
  record.state = state;
  record.set = true;
}

void MeshDraft::remember(VertexId v) {
  if (!marked_) return;
  const bool alive = incident(v) != kNone;
  vertices_at_mark_.try_emplace(v, alive ? std::optional(state(v).rest_body_m) : std::nullopt);
}

void MeshDraft::mark() {
  marked_ = true;
  vertex_slots_at_mark_ = vertex_slots_;
  triangle_slots_at_mark_ = triangle_slots_;
  vertices_at_mark_.clear();
  triangles_at_mark_.clear();
}

TopologyDelta MeshDraft::inverse_since_mark() const {
  TopologyDelta inv;
  inv.vertex_slots_after = vertex_slots_at_mark_;
  inv.triangle_slots_after = triangle_slots_at_mark_;
  for (const auto& [v, rest] : vertices_at_mark_)
    inv.vertices.push_back({v, rest.has_value(), rest.value_or(Vec3::Zero())});
  for (const auto& [t, triangle] : triangles_at_mark_) inv.triangles.push_back({t, triangle});
  return inv;
}

bool MeshDraft::exchange(const std::map<TriangleId, Triangle>& after) {
  std::vector<PatchTriangle> patch;
  patch.reserve(after.size());
  for (const auto& [t, content] : after) {
    const TriangleRecord& record = edit_triangle(t);
    patch.push_back({t, record.triangle, record.neighbours, content});
  }
  std::vector<Link> links;
  if (!link_patch(patch, links)) return false;
  if (marked_)
    for (const PatchTriangle& p : patch) triangles_at_mark_.try_emplace(p.id, p.before);

  std::set<VertexId> orphans;
  for (const PatchTriangle& p : patch) {
    if (p.before.alive())
      for (const VertexId v : p.before.v) orphans.insert(v);
    triangles_[p.id] = {p.after, {kNone, kNone, kNone}};
  }
  for (const PatchTriangle& p : patch)
    if (p.after.alive())
      for (const VertexId v : p.after.v) {
        edit_vertex(v).incident = p.id;
        orphans.erase(v);
      }
  for (const VertexId v : orphans) {
    remember(v);
    edit_vertex(v).incident = kNone;
  }
  for (const Link& l : links) {
    TriangleRecord& record = edit_triangle(l.triangle);
    record.neighbours[static_cast<std::size_t>(record.triangle.corner_of(l.from))] = l.neighbour;
  }
  freed_vertices_.insert(orphans.begin(), orphans.end());
  return true;
}

bool MeshDraft::replace(std::span<const TriangleId> removed, std::span<const Triangle> added) {
  std::map<TriangleId, Triangle> after;
  for (std::size_t i = 0; i < added.size(); ++i) {
    const TriangleId t = i < removed.size()
                             ? removed[i]
                             : take_slot(freed_triangles_, triangle_cursor_, base_->free_triangles(), triangle_slots_);
    after[t] = added[i];
  }
  for (std::size_t i = added.size(); i < removed.size(); ++i) {
    after[removed[i]] = Triangle{};
    freed_triangles_.insert(removed[i]);
  }
  return exchange(after);
}

bool MeshDraft::undo(const TopologyDelta& inverse) {
  std::map<TriangleId, Triangle> after;
  for (const TriangleEdit& e : inverse.triangles) after[e.id] = e.triangle;
  for (const VertexEdit& e : inverse.vertices)
    if (e.alive && state(e.id).rest_body_m != e.rest_body_m) edit_vertex(e.id).state.rest_body_m = e.rest_body_m;
  if (!exchange(after)) return false;

  // The free lists of before: dead slots below the old counts are free, slots beyond them do not exist.
  vertex_slots_ = inverse.vertex_slots_after;
  triangle_slots_ = inverse.triangle_slots_after;
  for (const TriangleEdit& e : inverse.triangles) {
    if (e.triangle.alive() || e.id >= triangle_slots_)
      freed_triangles_.erase(e.id);
    else
      freed_triangles_.insert(e.id);
  }
  for (const VertexEdit& e : inverse.vertices) {
    if (e.alive || e.id >= vertex_slots_)
      freed_vertices_.erase(e.id);
    else
      freed_vertices_.insert(e.id);
  }
  freed_vertices_.erase(freed_vertices_.lower_bound(vertex_slots_), freed_vertices_.end());
  return true;
}

TopologyDelta MeshDraft::delta() const {
  TopologyDelta d;
  d.base_revision = base_->revision();
  d.revision = d.base_revision + 1;
  d.vertex_slots_after = vertex_slots_;
  d.triangle_slots_after = triangle_slots_;
  std::uint64_t hash = base_->hash() - slots_hash(base_->vertex_slots(), base_->triangle_slots()) +
                       slots_hash(vertex_slots_, triangle_slots_);
  for (const auto& [v, record] : vertices_) {
    const bool alive = record.incident != kNone;
    const bool was_alive = v < base_->vertex_slots() && base_->vertex_alive(v);
    const bool new_slot = v >= base_->vertex_slots();
    if (new_slot && v >= vertex_slots_) continue;  // added and removed within the draft
    if (alive == was_alive && !new_slot && (!alive || record.state.rest_body_m == base_->rest_body_m(v))) continue;
    d.vertices.push_back({v, alive, alive ? record.state.rest_body_m : Vec3::Zero()});
    if (was_alive) hash -= vertex_hash(v, base_->rest_body_m(v));
    if (alive) hash += vertex_hash(v, record.state.rest_body_m);
  }
  for (const auto& [t, record] : triangles_) {
    const bool new_slot = t >= base_->triangle_slots();
    if (new_slot && t >= triangle_slots_) continue;
    const Triangle before = new_slot ? Triangle{} : base_->triangle(t);
    if (!new_slot && before == record.triangle) continue;
    d.triangles.push_back({t, record.triangle});
    if (before.alive()) hash -= triangle_hash(t, before);
    if (record.triangle.alive()) hash += triangle_hash(t, record.triangle);
  }
  d.hash_after = hash;
  return d;
}

std::vector<std::pair<VertexId, VertexState>> MeshDraft::seeds() const {
  std::vector<std::pair<VertexId, VertexState>> result;
  for (const auto& [v, record] : vertices_)
    if (record.set && record.incident != kNone) result.emplace_back(v, record.state);
  return result;
}

Vec3 rest_normal_of(const MeshDraft& draft, const std::array<VertexId, 3>& corners) {
  const Vec3 a = draft.rest(corners[0]);
  return (draft.rest(corners[1]) - a).cross(draft.rest(corners[2]) - a).stableNormalized();
}

}  // namespace sectio

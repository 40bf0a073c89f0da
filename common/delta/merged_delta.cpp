#include "common/delta/merged_delta.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace sectio {
namespace {

bool is_same(const VertexEdit& a, const VertexEdit& b) {
  if (!a.alive || !b.alive) return a.alive == b.alive;
  // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison)
  return std::memcmp(a.rest_body_m.data(), b.rest_body_m.data(), 3 * sizeof(double)) == 0;  // -0 isn't 0: bits count
}

bool is_same(const Triangle& a, const Triangle& b) {
  if (!a.alive() || !b.alive()) return a.alive() == b.alive();
  return a == b;
}

VertexEdit content_of(VertexId v, const TriangleMesh& mesh) {
  const bool alive = mesh.vertex_alive(v);
  return {v, alive, alive ? mesh.rest_body_m(v) : Vec3::Zero()};
}

// A slot that is new, or that goes, needs an edit; one beyond both counts was there in between only.
template <class Change>
bool is_told(std::uint32_t slot, const Change& change, std::uint32_t slots_before, std::uint32_t slots_after) {
  if (slot >= std::max(slots_before, slots_after)) return false;
  if (slot >= std::min(slots_before, slots_after)) return true;
  return !change.before || !is_same(*change.before, change.after);
}

}  // namespace

bool MergedDelta::add(const TopologyDelta& delta, const TriangleMesh& before) {
  if (last_ && last_->temporary != delta.temporary) return false;
  if (!last_) {
    base_revision_ = delta.base_revision;
    vertex_slots_before_ = before.vertex_slots();
    triangle_slots_before_ = before.triangle_slots();
  }
  for (const VertexEdit& edit : delta.vertices) {
    const auto [at, is_new] = vertices_.try_emplace(edit.id);
    if (is_new && edit.id < vertex_slots_before_) at->second.before = content_of(edit.id, before);
    at->second.after = edit;
  }
  for (const TriangleEdit& edit : delta.triangles) {
    const auto [at, is_new] = triangles_.try_emplace(edit.id);
    if (is_new && edit.id < triangle_slots_before_) at->second.before = before.triangle(edit.id);
    at->second.after = edit.triangle;
  }
  last_ = TopologyDelta{delta.base_revision,
                        delta.revision,
                        delta.hash_after,
                        delta.vertex_slots_after,
                        delta.triangle_slots_after,
                        delta.temporary,
                        {},
                        {}};
  return true;
}

TopologyDelta MergedDelta::take() {
  TopologyDelta merged = std::move(*last_);
  merged.base_revision = base_revision_;
  for (auto& [slot, change] : vertices_)
    if (is_told(slot, change, vertex_slots_before_, merged.vertex_slots_after)) merged.vertices.push_back(change.after);
  for (auto& [slot, change] : triangles_)
    if (is_told(slot, change, triangle_slots_before_, merged.triangle_slots_after))
      merged.triangles.push_back({slot, change.after});
  *this = {};
  return merged;
}

}  // namespace sectio

// What a delta that has been applied makes of a volume: the cut that was planned is done again and is final, or the
// tetrahedra of a part that left are gone.
#include <algorithm>
#include <utility>

#include "common/core/sort_unique.h"
#include "sim_server/volume/volume_cutting.h"

namespace sectio {
namespace {

struct Particles {
  std::vector<Vec4f> position_world_m, velocity_m_per_s;

  void add(const TetVertexState& state) {
    position_world_m.emplace_back(Vec4f::Zero()).head<3>() = state.position_world_m.cast<float>();
    velocity_m_per_s.emplace_back(Vec4f::Zero()).head<3>() = state.velocity_m_per_s.cast<float>();
  }
};

}  // namespace

void VolumeCutting::follow(const SharedBody& body, const TopologyChange& change) {
  if (collapsing_ && body.mesh.hash() == collapsing_->hash) {
    collapse(body);
  } else if (pending_ && body.mesh.hash() == pending_->hash) {
    volume_.undo_to(0);
    volume_.redo(pending_->steps);
    volume_.forget(pending_->final_steps);
    kinds_ = std::move(pending_->kinds);
    surface_.accept(pending_->slots);
    std::vector<VolumeDeformation::Slot> slots;
    for (const VertexId slot : pending_->slots.freed) slots.push_back({slot, kNone});
    for (const auto& [slot, v] : pending_->slots.taken) slots.push_back({slot, v});
    Particles added;
    for (const TetVertexState& state : pending_->added) added.add(state);
    engine_.change(pending_->change, added.position_world_m, added.velocity_m_per_s, slots);
    for (const auto& [v, state] : pending_->placed) {
      engine_.place(v, state.position_world_m, state.velocity_m_per_s);
      for (const VertexId slot : surface_.slots_of(v)) {
        body.particles.place(slot, state.position_world_m, state.velocity_m_per_s);
        body.compact.changed(body.particles, slot);
      }
    }
    keep(body, pending_->before);
    ways_ = std::move(pending_->ways);
    tidied_ = 0;
  } else {
    std::vector<VertexId> gone;
    for (const VertexEdit& e : change.delta.vertices)
      if (!e.alive) gone.push_back(e.id);
    let_go(gone);
  }
  pending_.reset();
}

// Of those that there are, each once.
VolumeCutting::Momentum VolumeCutting::momentum(const SharedBody& body, std::vector<VertexId> of) const {
  Momentum sum{std::move(of)};
  sort_unique(sum.of);
  for (const VertexId v : sum.of)
    if (v < engine_.position_world_m().size())
      sum.sum_n_s += engine_.model().mass_kg(v) * state_of(body, v).velocity_m_per_s;
  return sum;
}

// Masses go by volume: those around share what momentum that would make or take.
void VolumeCutting::keep(const SharedBody& body, const Momentum& before) {
  if (before.of.empty()) return;
  const Vec3 missing_n_s = before.sum_n_s - momentum(body, before.of).sum_n_s;
  const auto is_free = [&](VertexId v) {
    return v < engine_.position_world_m().size() && engine_.model().inverse_mass_per_kg(v) > 0;  // not fixed, not gone
  };
  double free_kg = 0;
  for (const VertexId v : before.of)
    if (is_free(v)) free_kg += engine_.model().mass_kg(v);
  if (free_kg == 0) return;
  const Vec3 faster = missing_n_s / free_kg;
  for (const VertexId v : before.of) {
    if (!is_free(v)) continue;
    engine_.nudge(v, faster);
    for (const VertexId slot : surface_.slots_of(v))
      body.particles.velocity_world_m_per_s[slot].head<3>() += faster.cast<float>();
  }
}

// A vertex may be of other parts, too, where they touch: it has other slots there.
std::vector<std::uint32_t> VolumeCutting::tetrahedra_of(std::span<const VertexId> slots) const {
  std::vector<VertexId> sorted(slots.begin(), slots.end());
  std::ranges::sort(sorted);
  std::vector<std::uint32_t> begin;
  for (const VertexId slot : slots) {
    const VertexId v = surface_.vertex_of(slot);
    if (!std::ranges::all_of(surface_.slots_of(v), [&](VertexId s) { return std::ranges::binary_search(sorted, s); }))
      continue;
    begin.insert(begin.end(), volume_.star(v).begin(), volume_.star(v).end());
  }
  return volume_.connected(std::move(begin));
}

VolumePart VolumeCutting::part(std::span<const VertexId> slots) const {
  VolumePart part;
  std::map<VertexId, VertexId> number;
  const auto number_of = [&](VertexId v) {
    const auto [it, is_new] = number.try_emplace(v, static_cast<VertexId>(number.size()));
    if (is_new) {
      part.mesh.vertices_body_m.push_back(volume_.vertex(v).rest_body_m);
      part.position_world_m.push_back(engine_.position_world_m()[v]);
      part.velocity_m_per_s.push_back(engine_.velocity_m_per_s()[v]);
    }
    return it->second;
  };
  for (const VertexId slot : slots) part.vertex_of.push_back(number_of(surface_.vertex_of(slot)));
  for (const std::uint32_t t : tetrahedra_of(slots)) {
    Tetrahedron corners = volume_.tetrahedra()[t];
    for (VertexId& v : corners) v = number_of(v);
    part.mesh.tetrahedra.push_back(corners);
  }
  return part;
}

void VolumeCutting::let_go(std::span<const VertexId> slots) {
  if (slots.empty()) return;
  settle();
  const TetChange change = volume_.remove(tetrahedra_of(slots));
  VolumeSurface::Change freed;
  std::vector<VolumeDeformation::Slot> dead;
  for (const VertexId slot : slots) {
    freed.freed.push_back(slot);
    dead.push_back({slot, kNone});
  }
  surface_.accept(freed);
  engine_.change(change, {}, {}, dead);
  for (auto& [tool, way] : ways_)
    for (auto* list : {&way.cut, &way.near}) std::erase_if(*list, [&](VertexId v) { return !volume_.alive(v); });
}

}  // namespace sectio

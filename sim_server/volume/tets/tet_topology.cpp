#include "sim_server/volume/tets/tet_topology.h"

#include <algorithm>
#include <unordered_set>
#include <utility>

#include "common/core/error.h"
#include "common/core/sort_unique.h"

namespace sectio {
namespace {

void replace(Tetrahedron& t, VertexId from, VertexId to) {
  *std::ranges::find(t, from) = to;
}
}  // namespace

TetTopology::TetTopology(const TetMesh& mesh) : tets_(mesh.tetrahedra) {
  for (const Vec3& x : mesh.vertices_body_m) vertices_.push_back({x, x, Vec3::Zero()});
  star_.resize(vertices_.size());
  for (std::uint32_t t = 0; t < tets_.size(); ++t)
    for (const VertexId v : tets_[t]) star_.edit(v).push_back(t);
  fetched_.resize(vertices_.size(), 0);
  vertices_before_ = vertices_.size();
  tets_before_ = tets_.size();
}

void TetTopology::set_state(VertexId v, const Vec3& position_world_m, const Vec3& velocity_m_per_s) {
  TetVertexState& state = vertices_.edit(v);
  state.position_world_m = position_world_m;
  state.velocity_m_per_s = velocity_m_per_s;
  if (v < fetched_.size()) fetched_.edit(v) = fetch_;
}

void TetTopology::fetch_states_from(StateOf source) {
  source_ = std::move(source);
  ++fetch_;
  fetchable_ = vertices_.size();
  fetched_.resize(vertices_.size(), 0);
}

void TetTopology::fetch(VertexId v) const {
  fetched_.edit(v) = fetch_;
  const TetVertexState from = source_(v);
  TetVertexState& state = vertices_.edit(v);
  state.position_world_m = from.position_world_m;
  state.velocity_m_per_s = from.velocity_m_per_s;
}

TetMesh TetTopology::mesh() const {
  TetMesh mesh;
  std::vector<VertexId> number(vertices_.size(), kNone);
  for (VertexId v = 0; v < vertices_.size(); ++v) {
    if (!alive(v)) continue;
    number[v] = static_cast<VertexId>(mesh.vertices_body_m.size());
    mesh.vertices_body_m.push_back(vertices_[v].rest_body_m);
  }
  for (const Tetrahedron& t : tets_)
    if (t != kNoTetrahedron) mesh.tetrahedra.push_back({number[t[0]], number[t[1]], number[t[2]], number[t[3]]});
  return mesh;
}

std::uint32_t TetTopology::across(std::uint32_t t, std::size_t corner) const {
  const auto& side = kTetFaces[corner];
  const VertexId a = tets_[t][side[0]], b = tets_[t][side[1]], c = tets_[t][side[2]];
  for (const std::uint32_t u : star_[a])
    if (u != t && has(tets_[u], b) && has(tets_[u], c)) return u;
  return kNone;
}

std::vector<std::uint32_t> TetTopology::connected(std::vector<std::uint32_t> tetrahedra) const {
  std::unordered_set<std::uint32_t> seen(tetrahedra.begin(), tetrahedra.end());  // asked, never walked
  for (std::size_t k = 0; k < tetrahedra.size(); ++k)
    for (std::size_t corner = 0; corner < 4; ++corner)
      if (const std::uint32_t u = across(tetrahedra[k], corner); u != kNone && seen.insert(u).second)
        tetrahedra.push_back(u);
  sort_unique(tetrahedra);
  return tetrahedra;
}

void TetTopology::forget() {
  vertices_before_ = vertices_.size();
  tets_before_ = tets_.size();
  journal_.clear();
}

std::size_t TetTopology::tets_at(std::size_t mark) const {
  std::size_t tets = tets_before_;
  for (const Operation& o : std::span(journal_).first(mark)) tets += o.b == kNone ? 0 : o.tets.size();
  return tets;
}

TetChange TetTopology::change(std::size_t mark) const {
  TetChange change;
  change.first_added = static_cast<VertexId>(vertices_before_ + mark);
  for (std::size_t v = change.first_added; v < vertices_.size(); ++v)
    change.added_body_m.push_back(vertices_[v].rest_body_m);
  const std::size_t before = tets_at(mark);
  auto& [by_vertex, seen, round] = scratch_;
  seen.resize(std::max(seen.size(), tets_.size()), 0);
  ++round;
  std::vector<std::uint32_t> origin;  // by new tetrahedron
  for (const Operation& operation : std::span(journal_).subspan(mark)) {
    for (std::size_t k = 0; k < operation.tets.size(); ++k) {
      const std::uint32_t t = operation.tets[k];
      if (operation.b != kNone) origin.push_back(t < before ? t : origin[t - before]);
      if (t >= before || seen[t] == round) continue;
      seen[t] = round;
      change.tetrahedra.push_back({t, operation.corners[k], tets_[t], t});
    }
  }
  std::ranges::sort(change.tetrahedra, {}, &TetEdit::id);
  for (auto t = static_cast<std::uint32_t>(before); t < tets_.size(); ++t)
    change.tetrahedra.push_back({t, kNoTetrahedron, tets_[t], origin[t - before]});
  return change;
}

TetDelta TetTopology::take_back(std::size_t mark) {
  TetDelta delta;
  delta.vertices_before = vertices_before_ + mark;
  delta.tetrahedra_before = tets_at(mark);
  delta.tetrahedra_after = tets_.size();
  delta.tetrahedra = change(mark).tetrahedra;
  for (auto v = static_cast<VertexId>(delta.vertices_before); v < vertices_.size(); ++v)
    delta.added.push_back({vertices_[v].rest_body_m, *made_from(v)});
  std::vector<VertexId>& corners = delta.stars_of;
  std::vector<std::uint32_t>& is_corner = scratch_.by_vertex;
  is_corner.resize(std::max(is_corner.size(), vertices_.size()), 0);
  for (const TetEdit& e : delta.tetrahedra)
    for (const Tetrahedron& t : {e.before, e.after})
      for (const VertexId v : t)
        if (v != kNone && std::exchange(is_corner[v], 1u) == 0) corners.push_back(v);
  for (const VertexId v : corners) is_corner[v] = 0;
  std::ranges::sort(corners);
  for (const VertexId v : corners) delta.stars_after.add(star_[v]);
  for (std::size_t k = journal_.size(); k > mark; undo_to(--k))
    if (const Operation& o = journal_.back(); o.b == kNone) delta.joins.push_back({o.a, o.made, twin_share(o)});
  for (const VertexId v : corners)
    delta.stars_before.add(v < star_.size() ? std::span(star_[v]) : std::span<const std::uint32_t>());
  return delta;
}

void apply(const TetDelta& delta, TetTopology& volume) {
  SECTIO_ASSERT(volume.journal_.empty() && volume.vertices_.size() == delta.vertices_before + delta.removed.size() &&
                    volume.tets_.size() == delta.tetrahedra_before,
                "a delta fits the volume that it was made for");
  auto& vertices = volume.vertices_;
  vertices.resize(delta.vertices_before);
  for (const TetDelta::Vertex& v : delta.added) vertices.push_back({v.rest_body_m, v.rest_body_m, Vec3::Zero()});
  volume.tets_.resize(delta.tetrahedra_after, kNoTetrahedron);
  for (const TetEdit& e : delta.tetrahedra)
    if (e.id < volume.tets_.size()) volume.tets_.edit(e.id) = e.after;
  volume.star_.resize(vertices.size());
  for (std::size_t k = 0; k < delta.stars_of.size(); ++k)
    if (const VertexId v = delta.stars_of[k]; v < vertices.size()) {
      const auto star = delta.stars_after[k];
      volume.star_.edit(v).assign(star.begin(), star.end());
    }
  volume.fetchable_ = std::min(volume.fetchable_, delta.vertices_before);
  volume.forget();
}

TetChange TetTopology::remove(std::span<const std::uint32_t> tetrahedra) {
  SECTIO_ASSERT(journal_.empty(), "what leaves can't be undone");
  TetChange change;
  for (const std::uint32_t t : tetrahedra) {
    for (const VertexId v : tets_[t]) std::erase(star_.edit(v), t);
    change.tetrahedra.push_back({t, std::exchange(tets_.edit(t), kNoTetrahedron), kNoTetrahedron, t});
  }
  std::ranges::sort(change.tetrahedra, {}, &TetEdit::id);
  return change;
}

TetChange TetTopology::collapse_change(VertexId v, VertexId onto) const {
  TetChange change;
  for (const std::uint32_t t : star_[v]) {
    const Tetrahedron& before = tets_[t];
    Tetrahedron after = kNoTetrahedron;
    if (!has(before, onto)) {
      after = before;
      replace(after, v, onto);
    } else if (const std::uint32_t u =
                   across(t, static_cast<std::size_t>(std::ranges::find(before, v) - before.begin()));
               u != kNone) {
      change.tetrahedra.push_back({u, tets_[u], tets_[u], u});
    }
    change.tetrahedra.push_back({t, before, after, t});
  }
  std::ranges::sort(change.tetrahedra, {}, &TetEdit::id);
  const auto is_same = [](const TetEdit& a, const TetEdit& b) { return a.id == b.id; };
  change.tetrahedra.erase(std::unique(change.tetrahedra.begin(), change.tetrahedra.end(), is_same),
                          change.tetrahedra.end());
  return change;
}

TetChange TetTopology::collapse(VertexId v, VertexId onto) {
  SECTIO_ASSERT(journal_.empty(), "a collapse can't be undone");
  TetChange change = collapse_change(v, onto);
  for (const TetEdit& e : change.tetrahedra) {
    if (e.before == e.after) continue;
    tets_.edit(e.id) = e.after;
    if (e.after == kNoTetrahedron) {
      for (const VertexId u : e.before) std::erase(star_.edit(u), e.id);
    } else {
      star_.edit(onto).push_back(e.id);
    }
  }
  star_.edit(v).clear();
  return change;
}

VertexId TetTopology::split(VertexId a, VertexId b, double t) {
  SECTIO_ASSERT(t > 0 && t < 1, "an edge is split between its ends");
  const auto n = static_cast<VertexId>(vertices_.size());
  const TetVertexState from = vertex(a), to = vertex(b);
  const auto between = [t](const Vec3& p, const Vec3& q) -> Vec3 { return p + t * (q - p); };
  vertices_.push_back({between(from.rest_body_m, to.rest_body_m), between(from.position_world_m, to.position_world_m),
                       between(from.velocity_m_per_s, to.velocity_m_per_s)});
  star_.push_back({});
  Operation operation{a, b, n, t, {}, {}, {}};
  for (std::size_t k = 0; k < star_[b].size(); ++k) {
    std::uint32_t& at_b = star_.edit(b)[k];
    const std::uint32_t old = at_b;
    if (!has(tets_[old], a)) continue;
    const auto made = static_cast<std::uint32_t>(tets_.size());
    operation.tets.push_back(old);
    operation.corners.push_back(tets_[old]);
    tets_.push_back(Tetrahedron(tets_[old]));
    replace(tets_.edit(made), a, n);
    replace(tets_.edit(old), b, n);
    at_b = made;
    for (const VertexId v : tets_[made])
      if (v != n && v != b) star_.edit(v).push_back(made);
    std::vector<std::uint32_t>& at_n = star_.edit(n);
    at_n.insert(at_n.end(), {old, made});
  }
  SECTIO_ASSERT(!operation.tets.empty(), "an edge has a tetrahedron");
  journal_.push_back(std::move(operation));
  return n;
}

void TetTopology::undo_split(const Operation& operation) {
  for (std::size_t k = operation.tets.size(); k-- > 0;) {
    const std::uint32_t old = operation.tets[k], made = static_cast<std::uint32_t>(tets_.size() - 1);
    for (const VertexId v : tets_[made])
      if (v != operation.made && v != operation.b) star_.edit(v).pop_back();
    *std::ranges::find(star_.edit(operation.b), made) = old;
    replace(tets_.edit(old), operation.made, operation.b);
    tets_.pop_back();
  }
}

VertexId TetTopology::part(VertexId v, std::span<const std::uint32_t> of) {
  const auto twin = static_cast<VertexId>(vertices_.size());
  vertices_.push_back(TetVertexState(vertex(v)));
  Operation operation{v, kNone, twin, 0, star_[v], {}, {of.begin(), of.end()}};
  for (const std::uint32_t t : star_[v]) operation.corners.push_back(tets_[t]);
  journal_.push_back(std::move(operation));
  star_.push_back({of.begin(), of.end()});
  for (const std::uint32_t t : of) replace(tets_.edit(t), v, twin);
  std::erase_if(star_.edit(v), [&](std::uint32_t t) { return !has(tets_[t], v); });
  SECTIO_ASSERT(!star_[v].empty() && !of.empty(), "both twins have a tetrahedron");
  return twin;
}

double TetTopology::face_m2(VertexId a, VertexId b, VertexId c) const {
  const Vec3& p = vertex(a).rest_body_m;
  return 0.5 * (vertex(b).rest_body_m - p).cross(vertex(c).rest_body_m - p).norm();
}

double TetTopology::volume_m3(std::uint32_t t) const {
  const auto at = [&](std::size_t k) -> const Vec3& { return vertices_[tets_[t][k]].rest_body_m; };
  return tet_volume_m3(at(0), at(1), at(2), at(3));
}

double TetTopology::volume_at(VertexId v) const {
  double volume = 0;
  for (const std::uint32_t t : star_[v]) volume += volume_m3(t);
  return volume;
}

double TetTopology::twin_share(const Operation& part) const {
  return volume_at(part.made) / (volume_at(part.made) + volume_at(part.a));
}

void TetTopology::undo_part(const Operation& operation) {
  const VertexId v = operation.a, twin = operation.made;
  const double share = twin_share(operation);
  const TetVertexState kept = vertex(v), other = vertex(twin);
  set_state(v, kept.position_world_m + share * (other.position_world_m - kept.position_world_m),
            kept.velocity_m_per_s + share * (other.velocity_m_per_s - kept.velocity_m_per_s));
  for (const std::uint32_t t : star_[twin]) replace(tets_.edit(t), twin, v);
  star_.edit(v) = operation.tets;
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
  fetchable_ = std::min(fetchable_, vertices_.size());
}

}  // namespace sectio

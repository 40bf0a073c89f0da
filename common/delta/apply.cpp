#include <algorithm>
#include <utility>

#include "common/core/sort_unique.h"
#include "common/delta/topology_delta.h"
#include "common/mesh/patch.h"

namespace sectio {

const char* to_string(ApplyStatus status) {
  switch (status) {
    case ApplyStatus::applied:
      return "applied";
    case ApplyStatus::stale:
      return "stale";
    case ApplyStatus::gap:
      return "gap";
    case ApplyStatus::hash_mismatch:
      return "hash mismatch";
    case ApplyStatus::malformed:
      return "malformed";
  }
  return "?";
}

namespace {

template <class Edit>
bool ascending(const std::vector<Edit>& edits) {
  return std::adjacent_find(edits.begin(), edits.end(), [](const Edit& a, const Edit& b) { return a.id >= b.id; }) ==
         edits.end();
}

template <class Edit>
const Edit* find(const std::vector<Edit>& edits, std::uint32_t id) {
  const auto it =
      std::lower_bound(edits.begin(), edits.end(), id, [](const Edit& e, std::uint32_t i) { return e.id < i; });
  return it != edits.end() && it->id == id ? &*it : nullptr;
}

// Every slot between the two counts needs an edit, which fills a new slot or frees a truncated one.
template <class Edit>
bool covers(const std::vector<Edit>& edits, std::uint32_t before, std::uint32_t after, bool (*alive)(const Edit&)) {
  const auto [low, high] = std::minmax(before, after);
  const auto first =
      std::lower_bound(edits.begin(), edits.end(), low, [](const Edit& e, std::uint32_t i) { return e.id < i; });
  if (static_cast<std::uint64_t>(edits.end() - first) < high - low) return false;
  if (!edits.empty() && edits.back().id >= high) return false;
  return after >= before || std::none_of(first, edits.end(), alive);
}

}  // namespace

// Changes a mesh and can take the change back. Validation is by trial: every test sees the mesh after the change.
class MeshWriter {
 public:
  MeshWriter(const TopologyDelta& delta, TriangleMesh& mesh) : delta_(delta), mesh_(mesh) {}

  ApplyStatus run() {
    if (delta_.revision <= mesh_.revision_) return ApplyStatus::stale;
    if (delta_.base_revision > mesh_.revision_) return ApplyStatus::gap;
    if (!delta_.temporary && mesh_.has_temporary_elements()) return ApplyStatus::malformed;
    if (delta_.base_revision != mesh_.revision_ || !well_formed()) return ApplyStatus::malformed;
    if (hash_after() != delta_.hash_after) return ApplyStatus::hash_mismatch;
    collect_patch();
    std::vector<Link> links;
    if (!link_patch(patch_, links)) return ApplyStatus::malformed;
    std::vector<std::pair<VertexId, std::uint32_t>> valence;
    if (!expected_valence(valence)) return ApplyStatus::malformed;
    write(links);
    if (!fans_hold(valence)) {
      take_back();
      return ApplyStatus::malformed;
    }
    finish();
    return ApplyStatus::applied;
  }

 private:
  bool well_formed() const {
    if (!ascending(delta_.vertices) || !ascending(delta_.triangles)) return false;
    if (!covers<VertexEdit>(delta_.vertices, mesh_.vertex_slots(), delta_.vertex_slots_after,
                            [](const VertexEdit& e) { return e.alive; }) ||
        !covers<TriangleEdit>(delta_.triangles, mesh_.triangle_slots(), delta_.triangle_slots_after,
                              [](const TriangleEdit& e) { return e.triangle.alive(); }))
      return false;
    for (const VertexEdit& e : delta_.vertices)
      if (e.alive && !e.rest_body_m.allFinite()) return false;
    for (const TriangleEdit& e : delta_.triangles) {
      if (static_cast<std::uint8_t>(e.triangle.surface) > static_cast<std::uint8_t>(Surface::wall)) return false;
      const auto& v = e.triangle.v;
      if (!e.triangle.alive()) {
        if (v[1] != kNone || v[2] != kNone) return false;
        continue;
      }
      if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) return false;
      for (const VertexId x : v)
        if (!alive_after(x)) return false;
    }
    return true;
  }

  bool alive_after(VertexId v) const {
    if (const VertexEdit* e = find(delta_.vertices, v)) return e->alive;
    return v < mesh_.vertex_slots() && mesh_.vertex_alive(v);
  }

  std::uint64_t hash_after() const {
    std::uint64_t h = mesh_.hash_ - slots_hash(mesh_.vertex_slots(), mesh_.triangle_slots()) +
                      slots_hash(delta_.vertex_slots_after, delta_.triangle_slots_after);
    for (const VertexEdit& e : delta_.vertices) {
      if (e.id < mesh_.vertex_slots() && mesh_.vertex_alive(e.id)) h -= vertex_hash(e.id, mesh_.rest_[e.id]);
      if (e.alive) h += vertex_hash(e.id, e.rest_body_m);
    }
    for (const TriangleEdit& e : delta_.triangles) {
      if (e.id < mesh_.triangle_slots() && mesh_.triangles_[e.id].alive())
        h -= triangle_hash(e.id, mesh_.triangles_[e.id]);
      if (e.triangle.alive()) h += triangle_hash(e.id, e.triangle);
    }
    return h;
  }

  void collect_patch() {
    patch_.reserve(delta_.triangles.size());
    for (const TriangleEdit& e : delta_.triangles) {
      PatchTriangle p{e.id, {}, {kNone, kNone, kNone}, e.triangle};
      if (e.id < mesh_.triangle_slots()) {
        p.before = mesh_.triangles_[e.id];
        p.neighbours_before = mesh_.neighbours_[e.id];
      }
      patch_.push_back(p);
    }
  }

  // The triangles that each vertex of the patch must have afterwards: those outside the patch and the new ones.
  bool expected_valence(std::vector<std::pair<VertexId, std::uint32_t>>& valence) const {
    std::vector<VertexId> before, after, touched;
    for (const PatchTriangle& p : patch_) {
      if (p.before.alive()) before.insert(before.end(), p.before.v.begin(), p.before.v.end());
      if (p.after.alive()) after.insert(after.end(), p.after.v.begin(), p.after.v.end());
    }
    for (const VertexEdit& e : delta_.vertices) touched.push_back(e.id);
    touched.insert(touched.end(), before.begin(), before.end());
    touched.insert(touched.end(), after.begin(), after.end());
    std::sort(before.begin(), before.end());
    std::sort(after.begin(), after.end());
    sort_unique(touched);
    const auto count = [](const std::vector<VertexId>& list, VertexId v) {
      const auto [first, last] = std::equal_range(list.begin(), list.end(), v);
      return static_cast<std::uint32_t>(last - first);
    };
    for (const VertexId v : touched) {
      const bool was_alive = v < mesh_.vertex_slots() && mesh_.vertex_alive(v);
      const std::uint32_t n = (was_alive ? fan_size(v) : 0) - count(before, v) + count(after, v);
      if (alive_after(v) ? n < 3 : n != 0) return false;
      if (n > 0) valence.emplace_back(v, n);
    }
    return true;
  }

  // The number of triangles around v, counted along the fan; 0 if the fan does not close.
  std::uint32_t fan_size(VertexId v, std::vector<VertexId>* rim = nullptr) const {
    const TriangleId first = mesh_.incident_[v];
    TriangleId t = first;
    std::uint32_t n = 0;
    do {
      const int i = mesh_.triangles_[t].corner_of(v);
      if (i < 0 || ++n > mesh_.triangle_slots()) return 0;
      if (rim) rim->push_back(mesh_.triangles_[t].v[static_cast<std::size_t>((i + 1) % 3)]);
      t = mesh_.neighbours_[t][static_cast<std::size_t>((i + 2) % 3)];
    } while (t != first && t != kNone);
    return t == first ? n : 0;
  }

  void write(const std::vector<Link>& links) {
    for (const Link& l : links)
      if (l.triangle < mesh_.triangle_slots())
        saved_neighbours_.emplace_back(l.triangle, mesh_.neighbours_[l.triangle]);
    for (const PatchTriangle& p : patch_)
      for (const VertexId v : p.before.v)
        if (p.before.alive()) saved_incident_.emplace_back(v, mesh_.incident_[v]);
    for (const PatchTriangle& p : patch_)
      for (const VertexId v : p.after.v)
        if (p.after.alive() && v < mesh_.vertex_slots()) saved_incident_.emplace_back(v, mesh_.incident_[v]);
    old_slots_ = {mesh_.vertex_slots(), mesh_.triangle_slots()};

    const std::size_t vertex_room = std::max(old_slots_.first, delta_.vertex_slots_after);
    const std::size_t triangle_room = std::max(old_slots_.second, delta_.triangle_slots_after);
    mesh_.rest_.resize(vertex_room, Vec3::Zero());
    mesh_.incident_.resize(vertex_room, kNone);
    mesh_.triangles_.resize(triangle_room);
    mesh_.neighbours_.resize(triangle_room, {kNone, kNone, kNone});
    for (const PatchTriangle& p : patch_) {
      mesh_.triangles_[p.id] = p.after;
      if (!p.after.alive()) {
        saved_neighbours_.emplace_back(p.id, p.neighbours_before);
        mesh_.neighbours_[p.id] = {kNone, kNone, kNone};
      }
      if (p.before.alive())
        for (const VertexId v : p.before.v) mesh_.incident_[v] = kNone;
    }
    for (const PatchTriangle& p : patch_)
      if (p.after.alive())
        for (const VertexId v : p.after.v) mesh_.incident_[v] = p.id;
    for (const Link& l : links)
      mesh_.neighbours_[l.triangle][static_cast<std::size_t>(mesh_.triangles_[l.triangle].corner_of(l.from))] =
          l.neighbour;
  }

  bool fans_hold(const std::vector<std::pair<VertexId, std::uint32_t>>& valence) const {
    std::vector<VertexId> rim;
    for (const auto& [v, expected] : valence) {
      rim.clear();
      if (mesh_.incident_[v] == kNone || fan_size(v, &rim) != expected) return false;
      std::sort(rim.begin(), rim.end());
      if (std::adjacent_find(rim.begin(), rim.end()) != rim.end()) return false;  // two edges with the same ends
    }
    return true;
  }

  void take_back() {
    for (auto it = saved_neighbours_.rbegin(); it != saved_neighbours_.rend(); ++it)
      mesh_.neighbours_[it->first] = it->second;
    for (auto it = saved_incident_.rbegin(); it != saved_incident_.rend(); ++it)
      mesh_.incident_[it->first] = it->second;
    for (const PatchTriangle& p : patch_)
      if (p.id < old_slots_.second) mesh_.triangles_[p.id] = p.before;
    mesh_.rest_.resize(old_slots_.first);
    mesh_.incident_.resize(old_slots_.first);
    mesh_.triangles_.resize(old_slots_.second);
    mesh_.neighbours_.resize(old_slots_.second);
  }

  void finish() {
    for (const VertexEdit& e : delta_.vertices) {
      const bool was_free = e.id < old_slots_.first && is_free(mesh_.free_vertices_, e.id);
      if (e.alive) mesh_.rest_[e.id] = e.rest_body_m;
      set_free(mesh_.free_vertices_, e.id, was_free, !e.alive && e.id < delta_.vertex_slots_after);
    }
    for (const PatchTriangle& p : patch_) {
      const bool was_free = p.id < old_slots_.second && is_free(mesh_.free_triangles_, p.id);
      set_free(mesh_.free_triangles_, p.id, was_free, !p.after.alive() && p.id < delta_.triangle_slots_after);
    }
    mesh_.rest_.resize(delta_.vertex_slots_after);
    mesh_.incident_.resize(delta_.vertex_slots_after);
    mesh_.triangles_.resize(delta_.triangle_slots_after);
    mesh_.neighbours_.resize(delta_.triangle_slots_after);
    mesh_.hash_ = delta_.hash_after;
    if (!delta_.temporary) mesh_.permanent_hash_ = delta_.hash_after;
    mesh_.revision_ = delta_.revision;
  }

  static bool is_free(const std::vector<std::uint32_t>& list, std::uint32_t id) {
    return std::binary_search(list.begin(), list.end(), id);
  }
  static void set_free(std::vector<std::uint32_t>& list, std::uint32_t id, bool was_free, bool now_free) {
    const auto it = std::lower_bound(list.begin(), list.end(), id);
    if (was_free && !now_free)
      list.erase(it);
    else if (!was_free && now_free)
      list.insert(it, id);
  }

  const TopologyDelta& delta_;
  TriangleMesh& mesh_;
  std::vector<PatchTriangle> patch_;
  std::vector<std::pair<TriangleId, std::array<TriangleId, 3>>> saved_neighbours_;
  std::vector<std::pair<VertexId, TriangleId>> saved_incident_;
  std::pair<std::uint32_t, std::uint32_t> old_slots_;
};

ApplyStatus apply(const TopologyDelta& delta, TriangleMesh& mesh) {
  return MeshWriter(delta, mesh).run();
}

TopologyDelta inverse(const TopologyDelta& delta, const TriangleMesh& before) {
  TopologyDelta inv;
  inv.base_revision = delta.revision;
  inv.revision = delta.revision + 1;
  inv.hash_after = before.hash();
  inv.vertex_slots_after = before.vertex_slots();
  inv.triangle_slots_after = before.triangle_slots();
  inv.temporary = delta.temporary;
  for (const VertexEdit& e : delta.vertices) {
    const bool alive = e.id < before.vertex_slots() && before.vertex_alive(e.id);
    inv.vertices.push_back({e.id, alive, alive ? before.rest_body_m(e.id) : Vec3::Zero()});
  }
  for (const TriangleEdit& e : delta.triangles)
    inv.triangles.push_back({e.id, e.id < before.triangle_slots() ? before.triangle(e.id) : Triangle{}});
  return inv;
}

}  // namespace sectio

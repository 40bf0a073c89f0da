#include "sim_server/volume/surface_map.h"

#include <algorithm>
#include <utility>

#include "common/core/number_table.h"
#include "common/core/sort_unique.h"
#include "common/mesh/slot_table.h"

namespace sectio {
namespace {

std::size_t place_of(const Corners3& corners, VertexId v) {
  return static_cast<std::size_t>(std::ranges::find(corners, v) - corners.begin());
}

// A triangle of the surface to be: one that is kept, or one that is new.
struct Side {
  Corners3 corners;  // in the volume
  Corners3 slots;    // kNone: not known yet
  TriangleId kept = kNone;
};

// The surface around what changes: triangles that are new, and those that stay at the same vertices.
class Patch {
 public:
  Patch(const SurfaceMap& surface, const TriangleMesh& mesh, const BoundaryChange& change,
        std::span<const VertexId> moved = {}) {
    for (const VertexId v : moved)
      if (!surface.slots_of(v).empty()) vertices_.push_back(v);
    for (const Corners3& corners : change.removed) {
      const TriangleId t = surface.triangle_of(mesh, corners);
      complete_ = complete_ && t != kNone;
      removed.push_back(t);
      vertices_.insert(vertices_.end(), corners.begin(), corners.end());
    }
    std::vector<std::pair<VertexId, std::size_t>> added;  // corner, side
    for (const Corners3& corners : change.added) {
      for (const VertexId v : corners) added.emplace_back(v, sides.size());
      vertices_.insert(vertices_.end(), corners.begin(), corners.end());
      sides.push_back({corners, {kNone, kNone, kNone}});
    }
    std::ranges::sort(added);
    sort_unique(vertices_);
    NumberTable<std::size_t> met;  // the side of a triangle that is kept, from 1
    for (const TriangleId t : removed) met.at(t) = kRemoved;
    auto next = added.begin();
    for (const VertexId v : vertices_) {
      for (; next != added.end() && next->first == v; ++next) at_.push_back(next->second);
      for (const VertexId slot : complete_ ? surface.slots_of(v) : std::span<const VertexId>())
        for (const TriangleId t : mesh.fan(slot)) {
          std::size_t& side = met.at(t);
          if (side == kRemoved) continue;
          if (side == 0) {
            sides.push_back({surface.in_volume(mesh.triangle(t)), mesh.triangle(t).v, t});
            side = sides.size();
          }
          at_.push_back(side - 1);
        }
      end_.push_back(at_.size());
    }
  }

  bool complete() const { return complete_; }
  // Around these something changes, ascending; and the triangles at each.
  std::span<const VertexId> vertices() const { return vertices_; }
  std::span<const std::size_t> at(std::size_t place) const {
    const std::size_t begin = place == 0 ? 0 : end_[place - 1];
    return std::span(at_).subspan(begin, end_[place] - begin);
  }

  // The fans into which the triangles at a vertex fall, in their order; empty when they don't.
  std::vector<std::vector<std::size_t>> fans(std::size_t place) const {
    const VertexId v = vertices_[place];
    const std::span<const std::size_t> all = at(place);
    std::vector<std::vector<std::size_t>> fans;
    std::vector<std::uint8_t> done(all.size(), 0);
    const auto next = [&](std::size_t n, std::size_t by) {
      const Corners3& c = sides[all[n]].corners;
      return c[(place_of(c, v) + by) % 3];
    };
    for (std::size_t start = 0; start < all.size(); ++start) {
      if (done[start]) continue;
      fans.emplace_back();
      std::size_t n = start;
      do {
        if (done[n]) return {};
        done[n] = 1;
        fans.back().push_back(all[n]);
        std::size_t m = 0;
        while (m < all.size() && next(m, 1) != next(n, 2)) ++m;
        if (m == all.size()) return {};
        n = m;
      } while (n != start);
    }
    return fans;
  }

  std::vector<TriangleId> removed;
  std::vector<Side> sides;  // new ones first

 private:
  static constexpr std::size_t kRemoved = ~std::size_t{0};

  bool complete_ = true;
  std::vector<VertexId> vertices_;
  std::vector<std::size_t> at_, end_;  // sides, vertex after vertex
};

}  // namespace

SurfaceMap::SurfaceMap(std::vector<VertexId> vertex_of, std::size_t vertices)
    : vertex_of_(std::move(vertex_of)), slots_of_(vertices) {
  for (VertexId slot = 0; slot < vertex_of_.size(); ++slot) slots_of_[vertex_of_[slot]].push_back(slot);
  give_room(vertex_of_, slots_of_);
}

std::span<const VertexId> SurfaceMap::slots_of(VertexId vertex) const {
  if (vertex >= slots_of_.size()) return {};
  return slots_of_[vertex];
}

TriangleId SurfaceMap::triangle_of(const TriangleMesh& mesh, const Corners3& corners) const {
  TriangleId found = kNone;
  for (const VertexId slot : slots_of(corners[0]))
    for (const TriangleId t : mesh.fan(slot)) {
      const auto& v = mesh.triangle(t).v;
      const auto i = static_cast<std::size_t>(mesh.triangle(t).corner_of(slot));
      if (vertex_of(v[(i + 1) % 3]) == corners[1] && vertex_of(v[(i + 2) % 3]) == corners[2]) found = t;
    }
  return found;
}

std::vector<std::array<VertexId, 2>> SurfaceMap::pinched_edges(const TriangleMesh& mesh,
                                                               const BoundaryChange& change) const {
  const Patch patch(*this, mesh, change);
  std::vector<std::array<VertexId, 2>> edges;
  // An edge is pinched if several new triangles have it in one direction.
  std::vector<VertexId> to;
  for (std::size_t place = 0; place < patch.vertices().size(); ++place) {
    const VertexId v = patch.vertices()[place];
    to.clear();
    for (const std::size_t n : patch.at(place)) {
      const Corners3& c = patch.sides[n].corners;
      to.push_back(c[(place_of(c, v) + 1) % 3]);
    }
    std::ranges::sort(to);
    for (std::size_t k = 1; k < to.size(); ++k)
      if (to[k] == to[k - 1]) edges.push_back({std::min(v, to[k]), std::max(v, to[k])});
  }
  sort_unique(edges);
  return edges;
}

bool SurfaceMap::plan(const TriangleMesh& mesh, const BoundaryChange& change, std::span<const VertexId> moved,
                      const StateOf& state_of, const LabelOf& label_of, MeshDraft& draft, Change& result) const {
  Patch patch(*this, mesh, change, moved);
  const auto has_moved = [&](VertexId v) { return std::ranges::binary_search(moved, v); };
  if (!patch.complete()) return false;
  std::vector<VertexId> had;  // slots of vertices at which something changes
  for (std::size_t place = 0; place < patch.vertices().size(); ++place) {
    const VertexId v = patch.vertices()[place];
    had.insert(had.end(), slots_of(v).begin(), slots_of(v).end());
    const auto fans = patch.fans(place);
    if (fans.empty() && !patch.at(place).empty()) return false;
    std::vector<VertexId> free(slots_of(v).begin(), slots_of(v).end());
    for (const std::vector<std::size_t>& fan : fans) {
      VertexId slot = kNone;
      for (const VertexId own : free)
        for (const std::size_t n : fan) {
          const Side& side = patch.sides[n];
          if (slot == kNone && side.slots[place_of(side.corners, v)] == own) slot = own;
        }
      if (slot != kNone) std::erase(free, slot);
      for (const std::size_t n : fan) {
        Side& side = patch.sides[n];
        side.slots[place_of(side.corners, v)] = slot;  // kNone: one that is left over, or a new one
      }
    }
    for (const std::vector<std::size_t>& fan : fans) {
      const Side& any = patch.sides[fan.front()];
      if (any.slots[place_of(any.corners, v)] != kNone) continue;
      VertexId slot = kNone;
      if (!free.empty()) {
        slot = free.front();
        free.erase(free.begin());
      } else {
        slot = draft.add_vertex(state_of(v));
        result.taken[slot] = v;
      }
      for (const std::size_t n : fan) {
        Side& side = patch.sides[n];
        side.slots[place_of(side.corners, v)] = slot;
      }
    }
  }
  std::vector<Triangle> added;
  for (const Side& side : patch.sides) {
    if (side.kept == kNone) {
      added.push_back({side.slots, label_of(side.corners)});
    } else {
      const Triangle& before = mesh.triangle(side.kept);
      const Triangle after{side.slots,
                           std::ranges::any_of(side.corners, has_moved) ? label_of(side.corners) : before.surface};
      if (after == before) continue;
      patch.removed.push_back(side.kept);
      added.push_back(after);
    }
  }
  sort_unique(patch.removed);
  if (!draft.replace(patch.removed, added)) return false;
  for (const VertexId slot : had) {
    if (draft.incident(slot) == kNone)
      result.freed.push_back(slot);
    else if (has_moved(vertex_of(slot)))
      draft.move_vertex(slot, state_of(vertex_of(slot)));
  }
  return true;
}

void SurfaceMap::accept(const Change& change) {
  for (const VertexId slot : change.freed) {
    std::erase(slots_of_[vertex_of_[slot]], slot);
    vertex_of_[slot] = kNone;
  }
  for (const auto& [slot, v] : change.taken) {
    if (slot >= vertex_of_.size()) resize_slots(vertex_of_, slot + 1, kNone);
    if (v >= slots_of_.size()) resize_slots(slots_of_, v + 1, {});
    vertex_of_[slot] = v;
    slots_of_[v].insert(std::ranges::lower_bound(slots_of_[v], slot), slot);
  }
}

}  // namespace sectio

// The incisions of a body as a record in its material. Little has to be written down: the vertices along the lips of
// grooves, with the bottom beneath each. All else follows from the mesh, as both lips have the same places at rest, bit
// for bit (incisions.h). A plan works on a copy, which a refused cut drops.
#pragma once

#include <algorithm>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "sim_server/surface/cutting/mesh_draft.h"

namespace sectio {

// The end of a groove of the template style: an edge from the surface down to the groove's bottom, at which both walls
// meet. The cut goes on from here, and another cut joins the groove here. Left and right are those of an instrument
// that came along the groove.
struct CutFront {
  VertexId top = kNone, bottom = kNone;
  bool bottom_on_surface = false;  // the blade came out on the other side
  // The vertices before the bottom along the trail: a pair, or one vertex twice.
  VertexId before_left = kNone, before_right = kNone;
  Vec3 ahead_body = Vec3::Zero();            // unit, at rest: out of the groove
  std::optional<VertexState> bottom_at_tip;  // the bottom's place after the next step; nothing: it is there

  template <class A>
  void archive(A& a) {
    a(top, bottom, bottom_on_surface, before_left, before_right, ahead_body, bottom_at_tip);
  }
};

// A vertex of a lip, and the bottom of the groove beneath it. An edge leads from the one to the other.
struct Rung {
  VertexId lip = kNone, bottom = kNone;

  template <class A>
  void archive(A& a) {
    a(lip, bottom);
  }
};

// Vertices in ascending order, each once: cheap to copy.
class SortedVertices {
 public:
  bool contains(VertexId v) const { return std::binary_search(sorted_.begin(), sorted_.end(), v); }
  void insert(VertexId v) {
    const auto it = std::lower_bound(sorted_.begin(), sorted_.end(), v);
    if (it == sorted_.end() || *it != v) sorted_.insert(it, v);
  }
  template <typename Gone>
  void remove_if(const Gone& gone) {
    std::erase_if(sorted_, gone);
  }
  std::size_t size() const { return sorted_.size(); }
  auto begin() const { return sorted_.begin(); }
  auto end() const { return sorted_.end(); }

  template <class A>
  void archive(A& a) {
    a(sorted_);
  }

 private:
  std::vector<VertexId> sorted_;
};

struct Grooves {
  std::map<VertexId, VertexId> ends;  // end vertex of a cut -> the bottom beneath it (paper B, figure 12)
  std::vector<Rung> rungs;            // rungs of the progressive style, ends included; ascending by lip
  SortedVertices bottoms;             // all vertices along the bottoms of grooves
  std::vector<CutFront> fronts;       // fronts of the template style, including those of cuts in progress

  // The bottom under the end of a cut; kNone where no cut ends.
  VertexId end_at(VertexId v) const {
    const auto it = ends.find(v);
    return it != ends.end() ? it->second : kNone;
  }

  // The bottom under a vertex of a lip; kNone for any other vertex.
  VertexId bottom_of(VertexId lip) const {
    const auto it = place_of(lip);
    return it != rungs.end() && it->lip == lip ? it->bottom : kNone;
  }
  void set_bottom(VertexId lip, VertexId bottom) {
    const auto it = rungs.begin() + (place_of(lip) - rungs.cbegin());
    if (it != rungs.end() && it->lip == lip)
      it->bottom = bottom;
    else
      rungs.insert(it, {lip, bottom});
    bottoms.insert(bottom);
  }

  bool has_front(const CutFront& front) const {
    return std::any_of(fronts.begin(), fronts.end(), [&](const CutFront& f) { return f.top == front.top; });
  }
  void add_front(CutFront front) {
    front.bottom_at_tip.reset();
    fronts.push_back(front);
  }
  void remove_front(const CutFront& front) {
    std::erase_if(fronts, [top = front.top](const CutFront& f) { return f.top == top; });
  }

  // Removes everything that names one of these vertices, which ascend.
  void forget(std::span<const VertexId> dead) {
    if (dead.empty()) return;
    const auto gone = [&](VertexId v) { return std::binary_search(dead.begin(), dead.end(), v); };
    std::erase_if(ends, [&](const auto& end) { return gone(end.first) || gone(end.second); });
    std::erase_if(rungs, [&](const Rung& r) { return gone(r.lip) || gone(r.bottom); });
    bottoms.remove_if(gone);
    std::erase_if(fronts, [&](const CutFront& f) {
      return gone(f.top) || gone(f.bottom) || gone(f.before_left) || gone(f.before_right);
    });
  }
  void forget_dead_of(const TopologyDelta& delta) {
    std::vector<VertexId> dead;
    for (const VertexEdit& e : delta.vertices)
      if (!e.alive) dead.push_back(e.id);
    forget(dead);
  }

  template <class A>
  void archive(A& a) {
    a(ends, rungs, bottoms, fronts);
  }

 private:
  std::vector<Rung>::const_iterator place_of(VertexId lip) const {
    return std::lower_bound(rungs.begin(), rungs.end(), lip, [](const Rung& r, VertexId v) { return r.lip < v; });
  }
};

}  // namespace sectio

// The grooves of a body as later cuts need them, and a draft of changes to them.
#pragma once

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <span>
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
};

struct Grooves {
  std::map<VertexId, VertexId> ends;  // end vertex of a cut -> the bottom beneath it (paper B, figure 12)
  std::set<VertexId> bottoms;         // all vertices along the bottoms of grooves
  std::vector<CutFront> fronts;       // of the template style, including those of cuts in progress

  // Removes everything that names one of these vertices, which ascend.
  void forget(std::span<const VertexId> dead) {
    if (dead.empty()) return;
    const auto gone = [&](VertexId v) { return std::binary_search(dead.begin(), dead.end(), v); };
    std::erase_if(ends, [&](const auto& end) { return gone(end.first) || gone(end.second); });
    std::erase_if(bottoms, gone);
    std::erase_if(fronts, [&](const CutFront& f) {
      return gone(f.top) || gone(f.bottom) || gone(f.before_left) || gone(f.before_right);
    });
  }
};

// Reads fall through to the grooves, writes stay in the draft until commit(). A refused cut drops its draft.
class GrooveDraft {
 public:
  explicit GrooveDraft(const Grooves& base) : base_(base) {}

  // The bottom under the end of a cut; kNone where no cut ends.
  VertexId end_at(VertexId v) const {
    if (const auto it = ends_.find(v); it != ends_.end()) return it->second;
    const auto it = base_.ends.find(v);
    return it != base_.ends.end() ? it->second : kNone;
  }
  void set_end(VertexId v, VertexId bottom) { ends_[v] = bottom; }
  void remove_end(VertexId v) { ends_[v] = kNone; }

  bool is_bottom(VertexId v) const { return bottoms_.contains(v) || base_.bottoms.contains(v); }
  void add_bottom(VertexId v) { bottoms_.insert(v); }

  const std::vector<CutFront>& fronts() const { return fronts_ ? *fronts_ : base_.fronts; }
  bool has_front(const CutFront& front) const {
    return std::any_of(fronts().begin(), fronts().end(), [&](const CutFront& f) { return f.top == front.top; });
  }
  void add_front(CutFront front) {
    if (!fronts_) fronts_ = base_.fronts;
    front.bottom_at_tip.reset();
    fronts_->push_back(front);
  }
  void remove_front(const CutFront& front) {
    if (!fronts_) fronts_ = base_.fronts;
    std::erase_if(*fronts_, [&](const CutFront& f) { return f.top == front.top; });
  }

  void commit(Grooves& grooves) const {
    for (const auto& [v, bottom] : ends_) {
      if (bottom == kNone)
        grooves.ends.erase(v);
      else
        grooves.ends[v] = bottom;
    }
    grooves.bottoms.insert(bottoms_.begin(), bottoms_.end());
    if (fronts_) grooves.fronts = *fronts_;
  }

 private:
  const Grooves& base_;
  std::map<VertexId, VertexId> ends_;
  std::set<VertexId> bottoms_;
  std::optional<std::vector<CutFront>> fronts_;
};

}  // namespace sectio

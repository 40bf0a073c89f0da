// What later cuts have to know about the grooves of a body, and a draft of changes to it.
#pragma once

#include <map>
#include <set>

#include "common/mesh/triangle_mesh.h"

namespace sectio {

struct Grooves {
  std::map<VertexId, VertexId> ends;  // end vertex of a cut -> the bottom beneath it (paper B, figure 12)
  std::set<VertexId> bottoms;         // all vertices along the bottoms of grooves
};

// Reads fall through; writes stay here until commit(). As with MeshDraft, what is refused is dropped.
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

  void commit(Grooves& grooves) const {
    for (const auto& [v, bottom] : ends_) {
      if (bottom == kNone)
        grooves.ends.erase(v);
      else
        grooves.ends[v] = bottom;
    }
    grooves.bottoms.insert(bottoms_.begin(), bottoms_.end());
  }

 private:
  const Grooves& base_;
  std::map<VertexId, VertexId> ends_;
  std::set<VertexId> bottoms_;
};

}  // namespace sectio

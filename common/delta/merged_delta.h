// Several deltas in a row as one: the last content of each slot that they change. It leaves out slots that come and go
// in between, as those of a cut's front do in every step: a viewer that sees a few of a thousand steps a second gets a
// fraction of their bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>

#include "common/delta/topology_delta.h"

namespace sectio {

class MergedDelta {
 public:
  // `before`: the mesh that the delta changes, as the deltas before this one have left it. False, and nothing is added,
  // where it can't go into one with those: temporary changes and permanent ones stay apart. take() them first.
  bool add(const TopologyDelta& delta, const TriangleMesh& before);

  bool empty() const { return !last_; }
  std::size_t slots() const { return vertices_.size() + triangles_.size(); }

  // Leaves it empty. It must not be empty before.
  TopologyDelta take();

 private:
  template <class Content>
  struct Change {
    std::optional<Content> before;  // nothing: there was no such slot
    Content after;
  };

  std::optional<TopologyDelta> last_;  // the newest delta, without its edits
  std::uint64_t base_revision_ = 0;
  std::uint32_t vertex_slots_before_ = 0, triangle_slots_before_ = 0;
  std::map<VertexId, Change<VertexEdit>> vertices_;
  std::map<TriangleId, Change<Triangle>> triangles_;
};

}  // namespace sectio

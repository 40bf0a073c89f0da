// A set of few of many vertices, in the order of insertion.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "common/mesh/slot_table.h"
#include "common/mesh/triangle_mesh.h"

namespace sectio {

class VertexSet {
 public:
  // Empties the set and admits vertices below this number. O(size of the set + growth of the number).
  void begin(std::size_t vertices) {
    for (const VertexId v : list_) in_[v] = 0;
    list_.clear();
    resize_slots<std::uint8_t>(in_, vertices, 0);
  }
  // False if the set already has the vertex.
  bool insert(VertexId v) {
    if (in_[v] != 0) return false;
    in_[v] = 1;
    list_.push_back(v);
    return true;
  }
  bool contains(VertexId v) const { return in_[v] != 0; }
  std::span<const VertexId> list() const { return list_; }
  // Sorts list() and returns it.
  std::span<const VertexId> sorted() {
    std::ranges::sort(list_);
    return list_;
  }

 private:
  std::vector<std::uint8_t> in_;  // by vertex
  std::vector<VertexId> list_;
};

}  // namespace sectio

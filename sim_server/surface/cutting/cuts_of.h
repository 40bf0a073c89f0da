// The cuts of one surface, whatever the style of their strokes.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "sim_server/surface/cutting/grooves.h"

namespace sectio {

template <class OneStroke>
struct CutsOf {
  Grooves grooves;
  std::vector<OneStroke> strokes;  // one for each instrument in the tissue

  const OneStroke* stroke_of(std::uint32_t edge_id) const {
    const auto it = std::ranges::find(strokes, edge_id, &OneStroke::edge_id);
    return it != strokes.end() ? &*it : nullptr;
  }
  std::vector<std::uint32_t> edges() const {
    std::vector<std::uint32_t> ids;
    for (const OneStroke& s : strokes) ids.push_back(s.edge_id);
    return ids;
  }

  template <class A>
  void archive(A& a) {
    a(grooves, strokes);
  }
};

}  // namespace sectio

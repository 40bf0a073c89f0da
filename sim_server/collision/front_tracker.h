// Local front tracking (paper B, section 3): once an instrument has been found at a surface, only the neighbours of the
// triangles where it was are searched.
//
// The walk alone would see one connected piece of surface and miss a second sheet. So a guard asks the tree which
// triangles lie within reach of the motion (a handful), and the walk must come to each of them over neighbours, near
// the instrument; otherwise the step counts as a global search. Either way exactly the triangles within reach are
// tested, so that the result is that of a test of every triangle: nothing is jumped over.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sim_server/collision/collision_engine.h"

namespace sectio {

struct FrontCounters {
  std::uint64_t local_searches = 0;   // steps whose triangles the walk all came to
  std::uint64_t global_searches = 0;  // steps with a triangle that it did not come to: first contact, fast motion,
                                      // dropped samples, another sheet
};

struct FrontStep {
  ToolCorners before, after;
  bool continuous = true;  // no sample is missing between the two
};

// One instrument at one body.
class FrontTracker {
 public:
  // A motion beyond this in one step is not quasi-static (5 m/s at 1 kHz): the walk is not trusted.
  static constexpr double kMaxWalkM = 0.005;
  // The walk goes over triangles within this distance of what the instrument can have reached.
  static constexpr double kWalkMarginM = 0.001;
  static constexpr std::size_t kMaxWalked = 2048;

  // The tree is that of the view, up to date.
  ToolContact follow(const SurfaceView& view, const CollisionEngine& tree, const FrontStep& step);

  // The slots of a delta that was applied; the walk may then start at the new triangles too.
  void topology_changed(const SurfaceView& view, std::span<const TriangleId> changed);

  // Forgets the front, as when the instrument jumped.
  void reset() { known_.clear(); }

  const FrontCounters& counters() const { return counters_; }

 private:
  bool walk_reaches(const SurfaceView& view, const ToolCorners& tool, double reach_m);

  std::vector<TriangleId> known_;             // where the walk starts: what was last within reach
  std::vector<TriangleId> near_;              // within reach now, ascending
  std::vector<TriangleId> walked_, visited_;  // in the order of the walk, and ascending
  FrontCounters counters_;
};

}  // namespace sectio

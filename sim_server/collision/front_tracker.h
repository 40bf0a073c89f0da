// Local front tracking (paper B, section 3): once an instrument has been found at a surface, only the neighbours of the
// triangles that it touched are searched.
//
// The walk alone would see one connected piece of surface and miss a second sheet. Therefore the tree reports the few
// triangles within reach of the motion, and the walk must arrive at each of them over neighbours near the instrument;
// otherwise the step counts as a global search. In both cases exactly the triangles within reach are tested, so that
// the result is the same as that of testing every triangle.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sim_server/collision/collision_engine.h"

namespace sectio {

struct FrontCounters {
  std::uint64_t local_searches = 0;   // steps in which the walk arrived at all triangles within reach
  std::uint64_t global_searches = 0;  // other steps: first contact, fast motion, dropped samples, another sheet

  template <class A>
  void archive(A& a) {
    a(local_searches, global_searches);
  }
};

struct FrontStep {
  ToolCorners before, after;
  bool continuous = true;  // no sample is missing between the two
};

// Tracks one instrument at one body.
class FrontTracker {
 public:
  // A longer motion in one step (5 m/s at 1 kHz) is not quasi-static, and the search is global.
  static constexpr double kMaxWalk_m = 0.005;
  // The walk visits triangles within this distance of the region that the instrument can have reached.
  static constexpr double kWalkMargin_m = 0.001;
  static constexpr std::size_t kMaxWalked = 2048;

  // The tree must be that of the view, and up to date.
  ToolContact follow(const SurfaceView& view, const CollisionEngine& tree, const FrontStep& step);

  // Takes the slots of a delta that was applied, so that the walk may start at new triangles, too.
  void topology_changed(const SurfaceView& view, std::span<const TriangleId> changed);

  // Forgets the front, for instance when the instrument has jumped.
  void reset() { known_.clear(); }

  const FrontCounters& counters() const { return counters_; }

  template <class A>
  void archive(A& a) {
    a(known_, near_, walked_, visited_, counters_);
  }

 private:
  bool walk_reaches(const SurfaceView& view, const ToolCorners& tool, double reach_m);

  std::vector<TriangleId> known_;             // triangles last within reach, at which the walk starts
  std::vector<TriangleId> near_;              // within reach now, ascending
  std::vector<TriangleId> walked_, visited_;  // in the order of the walk, and ascending
  FrontCounters counters_;
};

}  // namespace sectio

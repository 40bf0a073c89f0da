// The interface of a splitting engine: it finds the parts that have come off a body.
#pragma once

#include <span>

#include "sim_server/components/parts.h"
#include "sim_server/engine/engine.h"

namespace sectio {

class SplittingEngine : public Engine {
 public:
  // See separated_parts().
  virtual PartSearch separated(const SharedBody& body, std::span<const TriangleId> changed) = 0;
  // The whole component of a triangle. O(part).
  virtual Part whole(const SharedBody& body, TriangleId triangle) = 0;
};

// Keeps nothing, and searches when it is asked.
class SurfaceSplitting final : public SplittingEngine {
 public:
  PartSearch separated(const SharedBody& body, std::span<const TriangleId> changed) override {
    return separated_parts(body.mesh, changed);
  }
  Part whole(const SharedBody& body, TriangleId triangle) override { return part_at(body.mesh, triangle); }
  void follow(const SharedBody&, const TopologyChange&) override {}
  void archive(Archive&, const SharedBody&) override {}
};

}  // namespace sectio

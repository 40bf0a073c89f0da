// The bodies that random strokes are drawn on, and how many: one list for both styles of cutting.
#pragma once

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/delta/topology_delta.h"
#include "tests/support/shapes.h"

namespace sectio::test {

struct StrokeShape {
  std::string name;
  TriangleSoup soup;
  double step_m = 0;  // step of the instrument
};

std::vector<StrokeShape> stroke_shapes();

// 7 shapes x 8 seeds x (90 + 90) strokes: over ten thousand in both styles. A sanitizer makes each of them ten times as
// slow, so that there every tenth is drawn.
#ifdef SECTIO_SANITIZED
constexpr int kSampled = 10;
#else
constexpr int kSampled = 1;
#endif
constexpr std::uint64_t kStrokeSeeds = 8;
constexpr int kStrokesPerSeed = 90 / kSampled;

std::string name_of(const testing::TestParamInfo<StrokeShape>& shape);

// The volume that one delta takes away, from its own triangles alone: those at which a corner or a place has changed,
// before and after, seen from one of their vertices. It is right only if both close the same hole.
class VolumeAccount {
 public:
  explicit VolumeAccount(const TriangleMesh& mesh) : before_(mesh) {}

  void add(const TopologyDelta& delta, const TriangleMesh& after);
  double removed_m3() const { return removed_m3_; }

 private:
  double volume(const TriangleMesh& mesh, const std::set<TriangleId>& triangles) const;

  TriangleMesh before_;
  double removed_m3_ = 0;
};

}  // namespace sectio::test

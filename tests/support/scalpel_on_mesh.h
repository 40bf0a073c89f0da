// An instrument that strokes a mesh at rest, without simulation: for tests of cutting alone.
#pragma once

#include <gtest/gtest.h>

#include "common/mesh/check.h"
#include "sim_server/surface/cutting/plan_cut.h"
#include "tests/support/mesh_at_rest.h"

namespace sectio::test {

class ScalpelOnMesh : public MeshAtRest {
 public:
  explicit ScalpelOnMesh(const TriangleSoup& soup, StrokeSettings s = {}) : MeshAtRest(soup), settings(s) {}

  // The instrument enters at a point of a triangle.
  void enter(TriangleId triangle, const Vec3& bary, std::uint32_t tool_id = 0) {
    entries.push_back({tool_id, triangle, bary});
  }

  CutPlan step(const std::vector<BladeMotion>& motions) {
    CutPlan plan = plan_cut(mesh, view(), cuts, entries, motions, settings, true);
    entries.clear();
    refused += plan.refused;
    if (!accept(plan, mesh, cuts)) {
      ++rejected_deltas;
      return plan;
    }
    if (!plan.delta.empty()) ++made;
    seed(plan.seeds);
    return plan;
  }

  // One tool, one pose: tip `depth_m` beneath `surface_point`, upright along `up`.
  CutPlan to(const Vec3& surface_point, const Vec3& up, double depth_m, bool lift = false) {
    return step({{0, {{surface_point - depth_m * up, up, 1e9}}, lift}});
  }
  CutPlan lift() { return step({{0, {}, true}}); }

  const Stroke* stroke() const { return cuts.stroke_of(0); }
  bool going() const { return stroke() != nullptr; }

  void expect_valid() const {
    const SurfaceReport r = check(mesh);
    ASSERT_TRUE(r.valid()) << r.first_defect;
  }

  StrokeSettings settings;
  BodyCuts cuts;
  std::vector<Entry> entries;
  std::uint32_t refused = 0, rejected_deltas = 0, made = 0;
};

}  // namespace sectio::test

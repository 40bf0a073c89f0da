#include "tests/support/scalpel_on_mesh.h"

#include <gtest/gtest.h>

#include "common/mesh/check.h"

namespace sectio::test {

void ScalpelOnMesh::enter(TriangleId triangle, const Vec3& bary, std::uint32_t edge_id) {
  entries.push_back({edge_id, triangle, bary});
}

CutPlan ScalpelOnMesh::step(const std::vector<BladeMotion>& motions) {
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

CutPlan ScalpelOnMesh::to(const Vec3& surface_point, const Vec3& up, double depth_m, bool lift) {
  return step({{0, {{surface_point - depth_m * up, up, 1e9}}, lift}});
}

void ScalpelOnMesh::expect_valid() const {
  const SurfaceReport r = check(mesh);
  ASSERT_TRUE(r.valid()) << r.first_defect;
}

}  // namespace sectio::test

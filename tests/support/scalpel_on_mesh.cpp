#include "tests/support/scalpel_on_mesh.h"

#include <gtest/gtest.h>

#include "common/mesh/check.h"

namespace sectio::test {

ScalpelOnMesh::ScalpelOnMesh(const TriangleSoup& soup, StrokeSettings s)
    : MeshAtRest(soup), settings(s), euler_uncut_(static_cast<int>(check(mesh).euler_characteristic)) {}

std::vector<BladeMotion> ScalpelOnMesh::over_all(std::vector<BladeMotion> motions) const {
  for (BladeMotion& m : motions)
    for (TriangleId t = 0; t < mesh.triangle_slots(); ++t) m.active.push_back(t);
  return motions;
}

void ScalpelOnMesh::enter(TriangleId triangle, const Vec3& bary, std::uint32_t edge_id) {
  entries.push_back({edge_id, triangle, bary});
}

SurfaceCutPlan ScalpelOnMesh::step(const std::vector<BladeMotion>& motions) {
  SurfaceCutPlan plan = plan_cut(mesh, view(), cuts, entries, over_all(motions), settings, loops_free_islands);
  entries.clear();
  refused += plan.refused;
  if (!accept(plan)) {
    ++rejected_deltas;
    return plan;
  }
  if (!plan.delta.empty()) ++made;
  seed(plan.seeds);
  for (const Stroke& s : cuts.strokes) EXPECT_TRUE(s.met.empty()) << "where cuts met in this step, the next may not";
  return plan;
}

bool ScalpelOnMesh::accept(const SurfaceCutPlan& plan) {
  const bool fits = plan.delta.empty() || apply(plan.delta, mesh) == ApplyStatus::applied;
  if (fits)
    cuts = plan.after;
  else
    end_where_they_are(cuts);
  return fits;
}

int ScalpelOnMesh::tidy() {
  int changes = 0;
  for (LipSearch search{0, false, edge_m_}; search.next != kNone;) {
    const TidiedLips tidied = tidy_lips(mesh, view(), cuts.grooves, search);
    search = tidied.search;
    edge_m_ = search.edge_m;
    if (tidied.delta.empty()) continue;
    if (apply(tidied.delta, mesh) != ApplyStatus::applied) {
      ++rejected_deltas;
      break;
    }
    cuts.grooves = tidied.grooves;
    ++changes;
  }
  return changes;
}

SurfaceCutPlan ScalpelOnMesh::to(const Vec3& surface_point, const Vec3& up, double depth_m, bool lift) {
  return step({{0, {{surface_point - depth_m * up, up, 1e9}}, lift}});
}

std::string ScalpelOnMesh::flaw() const {
  const SurfaceReport r = check(mesh);
  if (!r.valid()) return r.first_defect;
  if (settings.style == CutStyle::templates) return {};
  Grooves grooves = cuts.grooves;
  for (const Stroke& s : cuts.strokes) add_temporary(s, grooves);
  return flaw_of(mesh, view(), grooves, euler_uncut_);
}

void ScalpelOnMesh::expect_valid() const {
  const std::string found = flaw();
  ASSERT_TRUE(found.empty()) << found;
}

}  // namespace sectio::test

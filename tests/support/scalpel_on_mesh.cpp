#include "tests/support/scalpel_on_mesh.h"

namespace sectio::test {

ScalpelOnMesh::ScalpelOnMesh(const TriangleSoup& soup, StrokeSettings s)
    : BladesOnMesh(soup), settings(s), euler_uncut_(static_cast<int>(check(mesh).euler_characteristic)) {}

SurfaceCutPlan ScalpelOnMesh::plan(const std::vector<BladeMotion>& motions) const {
  SurfaceCutPlan made_now = plan_cut(mesh, view(), cuts, entries, motions, settings, loops_free_islands);
  for (const Stroke& s : made_now.after.strokes)
    EXPECT_TRUE(s.met.empty()) << "where cuts met in this step, the next may not";
  return made_now;
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

std::string ScalpelOnMesh::flaw() const {
  if (const std::string of_surface = BladesOnMesh::flaw(); !of_surface.empty()) return of_surface;
  Grooves grooves = cuts.grooves;
  for (const Stroke& s : cuts.strokes) add_temporary(s, grooves);
  return flaw_of(mesh, view(), grooves, euler_uncut_);
}

}  // namespace sectio::test

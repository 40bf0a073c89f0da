#include "tests/support/knife_on_mesh.h"

#include <gtest/gtest.h>
#include <cstdio>

#include "common/mesh/check.h"

namespace sectio::test {

std::vector<TriangleId> KnifeOnMesh::all_triangles() const {
  std::vector<TriangleId> all;
  for (TriangleId t = 0; t < mesh.triangle_slots(); ++t)
    if (mesh.triangle(t).alive()) all.push_back(t);
  return all;
}

TemplateStep KnifeOnMesh::cut(const RestBlade& first, const RestBlade& last, const SweepEnds& ends) {
  MeshDraft draft(mesh, view());
  const TemplateStep step = cut_with_templates(draft, first, last, ends, all_triangles(), settings);
  EXPECT_TRUE(step.outcome == TemplateOutcome::cut || draft.delta().empty()) << "refused, but changed";
  commit(draft);
  return step;
}

TemplateStrokeEnd KnifeOnMesh::follow(TemplateStroke& stroke, const RestBlade& blade) {
  MeshDraft draft(mesh, view());
  EXPECT_TRUE(undo_temporary(draft, stroke));
  const TemplateStrokeEnd end = advance(draft, stroke, blade, all_triangles(), grooves, settings);
  faces.insert(faces.end(), stroke.faces.begin(), stroke.faces.end());
  if (end == TemplateStrokeEnd::going) open_temporarily(draft, stroke, settings);
  commit(draft);
  return end;
}

void KnifeOnMesh::lift(TemplateStroke& stroke) {
  MeshDraft draft(mesh, view());
  finish(draft, stroke, grooves);
  commit(draft);
}

bool KnifeOnMesh::valid() const {
  const SurfaceReport r = check(mesh);
  if (!r.valid()) std::printf("%s\n", r.first_defect.c_str());
  return r.valid();
}

bool KnifeOnMesh::commit(const MeshDraft& draft) {
  const TopologyDelta delta = draft.delta();
  if (delta.empty()) return true;
  const ApplyStatus status = apply(delta, mesh);
  EXPECT_EQ(status, ApplyStatus::applied) << to_string(status);
  seed(draft.seeds());
  if (applied) applied(delta);
  return status == ApplyStatus::applied;
}

RestBlade PadUnderKnife::at(double x_m, double y_m, double depth_m) {
  return {Vec3(x_m, y_m, kTop_m - depth_m), Vec3::UnitZ()};
}

std::vector<Triangle> PadUnderKnife::walls() const {
  std::vector<Triangle> result;
  for (const Triangle& t : mesh.triangles())
    if (t.alive() && t.surface == Surface::wall) result.push_back(t);
  return result;
}

Vec3 PadUnderKnife::normal(const Triangle& t) const {
  return (x(t.v[1]) - x(t.v[0])).cross(x(t.v[2]) - x(t.v[0])).stableNormalized();
}

std::vector<Triangle> PadUnderKnife::upper(int column, int row, bool above) const {
  std::vector<Triangle> result;
  for (const Triangle& t : mesh.triangles()) {
    if (!t.alive() || t.surface != Surface::skin || normal(t).z() < 0.99) continue;
    const double u = 100 * centre(t).x() - column, w = 100 * centre(t).y() - row;
    if (u >= 0 && u < 1 && w >= 0 && w < 1 && (w > u) == above) result.push_back(t);
  }
  return result;
}

}  // namespace sectio::test

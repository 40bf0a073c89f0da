// A knife that cuts a mesh at rest with templates, without simulation: for tests of that cutting style alone.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <set>

#include "common/mesh/check.h"
#include "sim_server/surface/cutting/template_stroke.h"
#include "tests/support/mesh_at_rest.h"
#include "tests/support/shapes.h"

namespace sectio::test {

class KnifeOnMesh : public MeshAtRest {
 public:
  explicit KnifeOnMesh(const TriangleSoup& soup, TemplateSettings s = {}) : MeshAtRest(soup), settings(s) {}

  // All of them: those that the sweep does not cross drop out.
  std::vector<TriangleId> all_triangles() const {
    std::vector<TriangleId> all;
    for (TriangleId t = 0; t < mesh.triangle_slots(); ++t)
      if (mesh.triangle(t).alive()) all.push_back(t);
    return all;
  }

  // One step of its own, from pose to pose.
  TemplateStep cut(const RestBlade& first, const RestBlade& last, const SweepEnds& ends = {}) {
    MeshDraft draft(mesh, view());
    const TemplateStep step = cut_with_templates(draft, first, last, ends, all_triangles(), settings);
    EXPECT_TRUE(step.outcome == TemplateOutcome::cut || draft.delta().empty()) << "refused, but changed";
    commit(draft);
    return step;
  }

  // The next step of a stroke.
  TemplateStrokeEnd follow(TemplateStroke& stroke, const RestBlade& blade) {
    MeshDraft draft(mesh, view());
    GrooveDraft groove_draft(grooves);
    EXPECT_TRUE(undo_temporary(draft, stroke));
    const TemplateStrokeEnd end = advance(draft, stroke, blade, all_triangles(), groove_draft, settings);
    faces.insert(faces.end(), stroke.faces.begin(), stroke.faces.end());
    if (end == TemplateStrokeEnd::going) open_temporarily(draft, stroke, settings);
    commit(draft);
    groove_draft.commit(grooves);
    return end;
  }
  void lift(TemplateStroke& stroke) {
    MeshDraft draft(mesh, view());
    GrooveDraft groove_draft(grooves);
    finish(draft, stroke, groove_draft);
    commit(draft);
    groove_draft.commit(grooves);
  }

  bool valid() const {
    const SurfaceReport r = check(mesh);
    if (!r.valid()) std::printf("%s\n", r.first_defect.c_str());
    return r.valid();
  }

  bool commit(const MeshDraft& draft) {
    const TopologyDelta delta = draft.delta();
    if (delta.empty()) return true;
    const ApplyStatus status = apply(delta, mesh);
    EXPECT_EQ(status, ApplyStatus::applied) << to_string(status);
    seed(draft.seeds());
    if (applied) applied(delta);
    return status == ApplyStatus::applied;
  }

  TemplateSettings settings;
  Grooves grooves;
  std::function<void(const TopologyDelta&)> applied;  // after each delta
  std::vector<ActiveFace> faces;
};

// A pad of 60 x 40 x 20 mm in cells of 10 mm: diagonals of the upper side go from lower left to upper right.
class PadUnderKnife : public KnifeOnMesh {
 public:
  static constexpr double kTop_m = 0.02;
  explicit PadUnderKnife(TemplateSettings s = {}) : KnifeOnMesh(box(6, 4, 2, Vec3(0.06, 0.04, kTop_m)), s) {}

  // Upright, the tip so deep beneath the upper side.
  static RestBlade at(double x_m, double y_m, double depth_m) {
    return {Vec3(x_m, y_m, kTop_m - depth_m), Vec3::UnitZ()};
  }
  std::vector<Triangle> walls() const {
    std::vector<Triangle> result;
    for (const Triangle& t : mesh.triangles())
      if (t.alive() && t.surface == Surface::wall) result.push_back(t);
    return result;
  }
  Vec3 x(VertexId v) const { return mesh.rest_body_m(v); }
  Vec3 centre(const Triangle& t) const { return (x(t.v[0]) + x(t.v[1]) + x(t.v[2])) / 3; }
  Vec3 normal(const Triangle& t) const {
    return (x(t.v[1]) - x(t.v[0])).cross(x(t.v[2]) - x(t.v[0])).stableNormalized();
  }
  // Skin triangles of the upper side whose centre is in the cell triangle (column, row, above its diagonal).
  std::vector<Triangle> upper(int column, int row, bool above) const {
    std::vector<Triangle> result;
    for (const Triangle& t : mesh.triangles()) {
      if (!t.alive() || t.surface != Surface::skin || normal(t).z() < 0.99) continue;
      const double u = 100 * centre(t).x() - column, w = 100 * centre(t).y() - row;
      if (u >= 0 && u < 1 && w >= 0 && w < 1 && (w > u) == above) result.push_back(t);
    }
    return result;
  }
};

}  // namespace sectio::test

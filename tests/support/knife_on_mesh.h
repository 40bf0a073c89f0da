// A knife that cuts a mesh at rest with templates, without simulation: for tests of that cutting style alone.
#pragma once

#include <functional>
#include <vector>

#include "sim_server/surface/cutting/template_stroke.h"
#include "tests/support/mesh_at_rest.h"
#include "tests/support/shapes.h"

namespace sectio::test {

class KnifeOnMesh : public MeshAtRest {
 public:
  explicit KnifeOnMesh(const TriangleSoup& soup, TemplateSettings s = {}) : MeshAtRest(soup), settings(s) {}

  // All of them: those that the sweep does not cross drop out.
  std::vector<TriangleId> all_triangles() const;

  // One step of its own, from pose to pose.
  TemplateStep cut(const RestBlade& first, const RestBlade& last, const SweepEnds& ends = {});

  // The next step of a stroke.
  TemplateStrokeEnd follow(TemplateStroke& stroke, const RestBlade& blade);
  void lift(TemplateStroke& stroke);

  bool valid() const;

  bool commit(const MeshDraft& draft);

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
  static RestBlade at(double x_m, double y_m, double depth_m);
  std::vector<Triangle> walls() const;
  Vec3 x(VertexId v) const { return mesh.rest_body_m(v); }
  Vec3 centre(const Triangle& t) const { return (x(t.v[0]) + x(t.v[1]) + x(t.v[2])) / 3; }
  Vec3 normal(const Triangle& t) const;
  // Skin triangles of the upper side whose centre is in the cell triangle (column, row, above its diagonal).
  std::vector<Triangle> upper(int column, int row, bool above) const;
};

}  // namespace sectio::test

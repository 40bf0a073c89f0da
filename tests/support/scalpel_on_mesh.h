// An instrument that strokes a mesh at rest, without simulation: for tests of cutting alone.
#pragma once

#include <string>
#include <vector>

#include "sim_server/surface/cutting/plan_cut.h"
#include "sim_server/surface/cutting/tidy_lips.h"
#include "tests/support/mesh_at_rest.h"

namespace sectio::test {

class ScalpelOnMesh : public MeshAtRest {
 public:
  explicit ScalpelOnMesh(const TriangleSoup& soup, StrokeSettings s = {});

  // The instrument enters at a point of a triangle.
  void enter(TriangleId triangle, const Vec3& bary, std::uint32_t edge_id = 0);

  SurfaceCutPlan step(const std::vector<BladeMotion>& motions);

  // One tool, one pose: tip `depth_m` beneath `surface_point`, upright along `up`.
  SurfaceCutPlan to(const Vec3& surface_point, const Vec3& up, double depth_m, bool lift = false);
  SurfaceCutPlan lift() { return step({{0, {}, true}}); }

  // Mends slivers until there is nothing more to mend; how often the mesh has changed. For an instrument that is away.
  int tidy();

  const Stroke* stroke() const { return cuts.stroke_of(0); }
  bool going() const { return stroke() != nullptr; }

  // A closed manifold, with a record of incisions that fits it. The first flaw; empty: none.
  std::string flaw() const;
  void expect_valid() const;

  // Applies the delta and takes over the cuts of a plan. False when the delta does not fit: all strokes have ended.
  bool accept(const SurfaceCutPlan& plan);

  // The motions with all triangles, any of which a blade may cross.
  std::vector<BladeMotion> over_all(std::vector<BladeMotion> motions) const;

  StrokeSettings settings;
  bool loops_free_islands = true;
  SurfaceCuts cuts;
  std::vector<Entry> entries;
  std::uint32_t refused = 0, rejected_deltas = 0, made = 0;

 private:
  double edge_m_ = 0;  // mean edge of the mesh when it was first tidied
  int euler_uncut_ = 2;
};

}  // namespace sectio::test

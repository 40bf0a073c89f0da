// A scalpel that cuts a mesh at rest progressively.
#pragma once

#include <string>
#include <vector>

#include "sim_server/surface/cutting/tidy_lips.h"
#include "tests/support/blades_on_mesh.h"

namespace sectio::test {

class ScalpelOnMesh : public BladesOnMesh<SurfaceCutPlan> {
 public:
  explicit ScalpelOnMesh(const TriangleSoup& soup, StrokeSettings s = {});

  // Mends slivers until there is nothing more to mend; how often the mesh has changed. For an instrument that is away.
  int tidy();

  // The first flaw of the surface or of the record of incisions, which must fit it; empty: none.
  std::string flaw() const override;

  StrokeSettings settings;
  bool loops_free_islands = true;

 private:
  SurfaceCutPlan plan(const std::vector<BladeMotion>& motions) const override;

  double edge_m_ = 0;  // mean edge of the mesh when it was first tidied
  int euler_uncut_ = 2;
};

}  // namespace sectio::test

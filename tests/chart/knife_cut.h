// A body that lies on its lower side is cut by the simulator's own knife: every stage of a step takes part. The
// tetrahedra are those that a scene gives the body.
#pragma once

#include "common/mesh/tet_mesh.h"
#include "tests/chart/scene.h"

namespace sectio::chart {

// The knife goes in the plane of the scene's slit, with its edge from the slit's lower end upwards. At rest, without
// the numbers that are no longer in use.
TetMesh cut_by_knife(const ChartScene& scene, double tetrahedra);

// The tetrahedra that a scene gives the body, cut where the scene of the chart is cut by a knife. Made once.
const TetMesh& mesh_of(const ChartScene& scene, double tetrahedra);

}  // namespace sectio::chart

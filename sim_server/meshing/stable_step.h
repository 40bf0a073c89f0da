// The largest stable explicit step on a mesh of tetrahedra, a measure of the mesh's quality.
#pragma once

#include "common/mesh/tet_mesh.h"

namespace sectio {

struct ElasticConstants {
  double young_pa = 6000;
  double poisson = 0.45;
  double density_kg_per_m3 = 1060;
};

// 2 / sqrt(lambda_max(M^-1 K)) for linear elasticity at rest with linear elements and masses lumped by volume, by power
// iteration: never below the true limit, and within a few percent of it. O(iterations * tetrahedra).
double explicit_step_limit_s(const TetMesh& mesh, const ElasticConstants& constants, int iterations = 400);

}  // namespace sectio

// The largest stable explicit step on a mesh of tetrahedra, a measure of the mesh's quality.
#pragma once

#include "common/material/elastic_material.h"
#include "common/mesh/tet_mesh.h"

namespace sectio {

// 2 / sqrt(lambda_max(M^-1 K)) for linear elasticity at rest with linear elements and masses lumped by volume, by power
// iteration: never below the true limit, and within a few percent of it. O(iterations * tetrahedra).
double explicit_step_limit_s(const TetMesh& mesh, const ElasticMaterial& material, int iterations = 400);

}  // namespace sectio

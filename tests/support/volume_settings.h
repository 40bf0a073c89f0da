// Settings of a volume that many tests start from.
#pragma once

#include "common/mesh/tet_mesh.h"
#include "sim_server/deformation/tetra/volume_model.h"

namespace sectio::test {

inline VolumeSettings weightless(double step_s) {
  VolumeSettings settings;
  settings.step_s = step_s;
  settings.gravity_m_per_s2.setZero();
  return settings;
}

// Vertices with x below `end_m` are fixed.
inline VolumeSettings held_at_end(const TetMesh& mesh, double end_m, double step_s = 0.001) {
  VolumeSettings settings;
  settings.step_s = step_s;
  for (const Vec3& p : mesh.vertices_body_m) settings.fixed.push_back(p.x() < end_m);
  return settings;
}

}  // namespace sectio::test

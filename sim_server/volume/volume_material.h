// The material and driver of a volume, as a scene gives them.
#pragma once

#include "sim_server/deformation/tetra/tet_solid.h"
#include "sim_server/scene/scene.h"

namespace sectio {

inline VolumeMaterial volume_material(const MaterialSpec& m) {
  return {m, m.damping_per_s, {}};
}

inline VolumeIntegrator integrator_of(const BodySpec& body) {
  return body.volume.driver == "implicit" ? VolumeIntegrator::implicit_only : VolumeIntegrator::automatic;
}

}  // namespace sectio

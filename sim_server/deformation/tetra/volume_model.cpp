#include "sim_server/deformation/tetra/volume_model.h"

#include <algorithm>

namespace sectio {

int VolumeModel::substeps_for(double substep_limit_s) const {
  return std::max(1, static_cast<int>(std::min(1000.0, std::ceil(settings_.step_s / substep_limit_s))));
}

std::vector<SagPoint> VolumeModel::sag(const Vec3& gravity_body_m_per_s2) {
  const std::vector<Vec3> moved_m = sag_m(gravity_body_m_per_s2);
  std::vector<SagPoint> points;
  for (VertexId v = 0; v < moved_m.size(); ++v)
    if (inverse_mass_per_kg(v) > 0) points.push_back({mesh().vertices_body_m[v], moved_m[v], mass_kg(v)});
  return points;
}

VelocityUpdate VolumeModel::velocity_update(double substep_s) const {
  VelocityUpdate update;
  update.damping_factor = static_cast<float>(1 - material_.damping_per_s * substep_s);
  update.gravity_step = (substep_s * settings_.gravity_m_per_s2).cast<float>();
  update.max_speed_m_per_s = static_cast<float>(kMaxSpeed_m_per_s);
  return update;
}

double VolumeModel::energy_of_motion_j(std::span<const Vec4f> position_world_m,
                                       std::span<const Vec4f> velocity_m_per_s) const {
  double energy = 0;
  for (VertexId i = 0; i < position_world_m.size(); ++i) {
    const double inverse = inverse_mass_per_kg(i);
    if (inverse == 0) continue;
    energy += 0.5 / inverse * velocity_m_per_s[i].head<3>().cast<double>().squaredNorm();
    energy -= mass_kg(i) * gravity_m_per_s2().dot(position_world_m[i].head<3>().cast<double>());
  }
  return energy;
}

}  // namespace sectio

#include "sim_server/deformation/tetra/volume_model.h"

namespace sectio {

void DividedConstraints::begin(std::span<const PointConstraint> constraints, std::span<const Vec4f> position_world_m,
                               int parts) {
  constraints_.assign(constraints.begin(), constraints.end());
  start_.resize(constraints_.size());
  end_.resize(constraints_.size());
  part_.resize(constraints_.size());
  mean_.assign(constraints_.size(), {});
  parts_ = parts;
  for (std::size_t n = 0; n < constraints_.size(); ++n) {
    const PointConstraint& c = constraints_[n];
    Vec3 point = Vec3::Zero();
    for (std::size_t a = 0; a < 3; ++a)
      if (c.v[a] != kNone) point += c.w[a] * position_world_m[c.v[a]].head<3>().cast<double>();
    end_[n] = c.target_world_m;
    // Where a unilateral constraint is not broken yet, its plane is where it will be.
    const bool keeps = c.unilateral && (point - c.target_world_m).dot(c.normal) <= 0;
    start_[n] = keeps ? c.target_world_m : point;
  }
}

void DividedConstraints::project_part(int part, double part_s, std::span<const double> inverse_mass,
                                      std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s) {
  if (constraints_.empty()) return;
  const double s = static_cast<double>(part + 1) / parts_;
  for (std::size_t n = 0; n < constraints_.size(); ++n)
    constraints_[n].target_world_m = start_[n] + s * (end_[n] - start_[n]);
  project(constraints_, inverse_mass, part_s, position_world_m, velocity_m_per_s, part_);
  for (std::size_t n = 0; n < constraints_.size(); ++n) {
    mean_[n].force_on_tool_n += part_[n].force_on_tool_n / parts_;
    mean_[n].active = mean_[n].active || part_[n].active;
  }
}

void DividedConstraints::finish(std::span<Reaction> reactions) const {
  for (std::size_t n = 0; n < reactions.size(); ++n) reactions[n] = mean_[n];
}

}  // namespace sectio

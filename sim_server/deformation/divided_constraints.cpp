#include "sim_server/deformation/divided_constraints.h"

namespace sectio {

void DividedConstraints::begin(std::span<const PointConstraint> constraints, std::span<const Vec4f> position_world_m,
                               int substeps) {
  corners_of(constraints, supports_);
  begin(constraints, supports_, position_world_m, substeps);
}

void DividedConstraints::begin(std::span<const PointConstraint> constraints, const ConstraintSupports& supports,
                               std::span<const Vec4f> position_world_m, int substeps) {
  supports_ = supports;
  constraints_.assign(constraints.begin(), constraints.end());
  start_.resize(constraints_.size());
  end_.resize(constraints_.size());
  substep_reactions_.resize(constraints_.size());
  mean_.assign(constraints_.size(), {});
  substeps_ = substeps;
  for (std::size_t n = 0; n < constraints_.size(); ++n) {
    const PointConstraint& c = constraints_[n];
    const Vec3 point = carried(supports_.of(n), position_world_m);
    end_[n] = c.target_world_m;
    // A unilateral constraint that holds at the start has its plane at the target all along; so does one with a spring
    // in series, in which the point lies beyond the target.
    const bool keeps = c.unilateral && (c.compliance_m_per_n > 0 || (point - c.target_world_m).dot(c.normal) <= 0);
    start_[n] = keeps ? c.target_world_m : point;
  }
}

void DividedConstraints::project_substep(int substep, double substep_s, std::span<const double> inverse_mass,
                                         std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s) {
  if (constraints_.empty()) return;
  const double s = static_cast<double>(substep + 1) / substeps_;
  for (std::size_t n = 0; n < constraints_.size(); ++n)
    constraints_[n].target_world_m = start_[n] + s * (end_[n] - start_[n]);
  project(constraints_, supports_, inverse_mass, substep_s, position_world_m, velocity_m_per_s, substep_reactions_);
  for (std::size_t n = 0; n < constraints_.size(); ++n) {
    mean_[n].force_on_tool_n += substep_reactions_[n].force_on_tool_n / substeps_;
    mean_[n].active = mean_[n].active || substep_reactions_[n].active;
    mean_[n].work_j += substep_reactions_[n].work_j;
    if (constraints_[n].sticks && substep_reactions_[n].force_on_tool_n.isZero(0))
      stick_where_it_lands(n, carried(supports_.of(n), position_world_m));
  }
}

// A point that has come off and slid on is not drawn back along the surface: over so short a time it would be thrown.
void DividedConstraints::stick_where_it_lands(std::size_t n, const Vec3& point_world_m) {
  const Vec3 &normal = constraints_[n].normal, off = point_world_m - constraints_[n].target_world_m;
  const Vec3 aside = off - off.dot(normal) * normal;
  start_[n] += aside, end_[n] += aside;
}

void DividedConstraints::finish(std::span<Reaction> reactions) const {
  for (std::size_t n = 0; n < reactions.size(); ++n) reactions[n] = mean_[n];
}

}  // namespace sectio

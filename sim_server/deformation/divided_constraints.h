#pragma once

#include "sim_server/deformation/point_constraint.h"

namespace sectio {

// The constraints of a step that is taken in substeps. Each target that is not there yet moves evenly from the place of
// its point at the start; the reaction is the mean over the substeps, and its work is the sum.
class DividedConstraints {
 public:
  // Without supports, the corners of the constraints carry their points.
  void begin(std::span<const PointConstraint> constraints, std::span<const Vec4f> position_world_m, int substeps);
  void begin(std::span<const PointConstraint> constraints, const ConstraintSupports& supports,
             std::span<const Vec4f> position_world_m, int substeps);
  // Call after the motion of each substep, with the number of substeps before it.
  void project_substep(int substep, double substep_s, std::span<const double> inverse_mass,
                       std::span<Vec4f> position_world_m, std::span<Vec4f> velocity_m_per_s);
  void finish(std::span<Reaction> reactions) const;

 private:
  void stick_where_it_lands(std::size_t constraint, const Vec3& point_world_m);

  std::vector<PointConstraint> constraints_;
  ConstraintSupports supports_;
  std::vector<Vec3> start_, end_;
  std::vector<Reaction> substep_reactions_, mean_;
  int substeps_ = 1;
};

}  // namespace sectio

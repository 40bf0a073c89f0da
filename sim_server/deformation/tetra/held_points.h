// Points that instruments hold or press while an implicit driver looks for the balance of a step. An explicit driver
// finds the force of a constraint from the momentum that it takes in one step; an implicit one has moved the tissue as
// far as it goes by then. So each point has a multiplier, its force, which grows after every sweep of the descent by
// what the point misses its place by, times the stiffness that its vertices have in the descent:
//
//   lambda <- P(lambda + C^-1 (target - x)),  C = sum_a w_a^2 H_a^-1,  P: pushes only, largest force
//
// and the point is put to its place, x_a += w_a H_a^-1 C^-1 (target - x): what the vertices would have done with this
// force. At the fixed point everything is in balance.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "sim_server/deformation/point_constraint.h"

namespace sectio {

class HeldPoints {
 public:
  // Of a vertex as it is now: the Hessian of what the descent makes smaller, m / h^2 included, N/m.
  using Block = std::function<Mat3(VertexId)>;

  // Both spans outlive finish().
  void begin(std::span<const PointConstraint> constraints, std::span<const double> inverse_mass, double step_s);
  // After a sweep. Forces go into the inertial positions. Whether a vertex was moved.
  bool put(const Block& block_n_per_m, std::span<Vec4f> position_world_m, std::span<Vec4f> inertial_world_m);
  // Velocities change only where a constraint stops what it moved.
  void finish(std::span<Vec4f> velocity_m_per_s, std::span<Reaction> reactions) const;

 private:
  std::span<const PointConstraint> constraints_;
  std::span<const double> inverse_mass_;
  double step_s_ = 0;
  std::vector<Vec3> on_tissue_n_;
};

}  // namespace sectio

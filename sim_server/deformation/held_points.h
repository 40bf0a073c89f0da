// Points that instruments hold or press while an implicit driver looks for the balance of a step. An explicit driver
// finds the force of a constraint from the momentum that it takes in one step; an implicit one has moved the tissue as
// far as it goes by then. So each point has a multiplier, its force, which grows after every sweep of the descent by
// what the point misses its place by, times the stiffness that its particles have in the descent:
//
//   lambda <- P(lambda + C^-1 (target - x)),  C = sum_a w_a^2 H_a^-1,  P: pushes only, largest force
//
// and the point is put to its place, x_a += w_a H_a^-1 C^-1 (target - x): what the particles would have done with this
// force. At the fixed point everything is in balance.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "sim_server/deformation/point_constraint.h"

namespace sectio {

class HeldPoints {
 public:
  // The descent's own: its particles, which carry the points.
  struct Particles {
    std::function<Vec3(std::uint32_t)> position_world_m;
    // The Hessian of what the descent makes smaller, of this particle as it is now, m / h^2 included.
    std::function<Mat3(std::uint32_t)> block_n_per_m;
    std::function<void(std::uint32_t, const Vec3& position_by_m, const Vec3& inertial_by_m)> move;
  };

  // All of it outlives finish(). Of particles with an inverse mass of 0 nothing is asked.
  void begin(std::span<const PointConstraint> constraints, const ConstraintSupports& supports,
             std::span<const double> inverse_mass, double step_s);
  // After a sweep. Forces go into the inertial positions. Whether a particle was moved.
  bool put(const Particles& particles);
  // Velocities change only where a constraint stops what it moved.
  void finish(std::span<Vec4f> velocity_m_per_s, std::span<Reaction> reactions) const;

 private:
  std::span<const PointConstraint> constraints_;
  const ConstraintSupports* supports_ = nullptr;
  std::span<const double> inverse_mass_;
  double step_s_ = 0;
  std::vector<Vec3> on_tissue_n_;
  std::vector<Mat3> share_;
};

}  // namespace sectio

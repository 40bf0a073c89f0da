// Constraints of an implicit step, by the method of multipliers: points that instruments hold or press while block
// descent looks for the equilibrium of the step. (An explicit step gets the force of a constraint from the impulse that
// enforces it; an implicit step has no such impulse.) Each point has a multiplier lambda, its force. After every sweep
// the multiplier grows by the distance between the point and its target, times the stiffness of the point's particles:
//
//   lambda <- P(lambda + C^-1 (target - x)),  C = sum_a w_a^2 H_a^-1,  P: pushes only, largest force
//
// and the particles move by x_a += w_a H_a^-1 C^-1 (target - x), their response to the added force. A fixed point of
// this iteration is an equilibrium.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "sim_server/deformation/point_constraint.h"

namespace sectio {

class HeldPoints {
 public:
  // Access to the particles of the descent, which carry the points.
  struct Particles {
    std::function<Vec3(std::uint32_t)> position_world_m;
    // The 3 x 3 block of the objective's Hessian for this particle in the present state, m / h^2 included.
    std::function<Mat3(std::uint32_t)> block_n_per_m;
    std::function<void(std::uint32_t, const Vec3& position_by_m, const Vec3& inertial_by_m)> move;
  };

  // The arguments must outlive finish(). Particles of inverse mass 0 are neither asked for their block nor moved.
  void begin(std::span<const PointConstraint> constraints, const ConstraintSupports& supports,
             std::span<const double> inverse_mass, double step_s);
  // Call after each sweep. Forces enter through the inertial positions. Returns whether a particle was moved.
  bool put(const Particles& particles);
  // Changes velocities only where a constraint stops the particles that it moved.
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

// The driver that is stable at any step: steps of backward Euler by Newton's method (newton_step.h). Drag is implicit,
// too. A step whose residual stays above the tolerance is undone and taken in two, four, eight parts; what is still
// above it then is counted, and goes on from the best state found.
#pragma once

#include <cstdint>
#include <functional>

#include "sim_server/deformation/newton_step.h"

namespace sectio {

class ImplicitDriver {
 public:
  struct Motion {
    double step_s = 0.001, damping_per_s = 0;
    Vec3 gravity_m_per_s2 = Vec3::Zero();
    double largest_speed_m_per_s = 5;
  };
  // Held where the inverse mass is 0. Masses are those of the tissue, without what stability has added.
  struct Particles {
    std::span<const double> mass_kg, inverse_mass_per_kg;
    std::span<Vec4f> position_world_m, velocity_m_per_s;
  };
  // Makes a start better where Newton's method has failed: lowers the objective sweep by sweep, from any state.
  using Smoother =
      std::function<void(double step_s, std::span<const Vec3> inertial_world_m, std::span<Vec3> position_world_m)>;

  void step(ElasticEnergy& energy, const Motion& motion, const Particles& particles,
            std::span<const PointConstraint> constraints, const ConstraintSupports& supports,
            std::span<Reaction> reactions, const Smoother& smoother = {});

  double residual() const { return residual_; }             // by force, of the last step: the largest of its parts
  double residual_m() const { return residual_m_; }         // how far the last iteration moved something
  std::uint64_t steps_not_met() const { return not_met_; }  // so far
  int parts() const { return parts_; }                      // the last step's
  int products() const { return products_; }                // the last step's

 private:
  static constexpr int kMostParts = 8;

  bool take(ElasticEnergy& energy, Motion motion, const Particles& particles,
            std::span<const PointConstraint> constraints, const ConstraintSupports& supports,
            std::span<Reaction> reactions, int parts, const Smoother& smoother);

  NewtonStep newton_;
  std::vector<Vec3> inertial_, now_;
  std::vector<Vec4f> start_position_, start_velocity_;
  std::vector<PointConstraint> part_;
  std::vector<Vec3> from_, taken_along_;
  std::vector<Reaction> of_part_;
  double residual_ = 0, residual_m_ = 0;
  std::uint64_t not_met_ = 0;
  int parts_ = 1, products_ = 0;
};

}  // namespace sectio

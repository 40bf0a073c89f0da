// The driver that is stable at any step: Newton's method (newton_step.h) on steps of backward Euler, or, where long
// steps are a scene's choice, of BDF2, which damps far less: with x_0, v_0 now, x_-1, v_-1 a step ago, and H = 2 h / 3,
//
//   x = X + H v,  v = V + H (f(x) / m + g - alpha v),   X = (4 x_0 - x_-1) / 3,  V = (4 v_0 - v_-1) / 3
//
// is a step of backward Euler of length H from (X, V). The first step is one of backward Euler. A particle that
// others have moved or pushed since takes its past along; a new one has x_-1 = x_0 - h v_0. Newton's method begins at
// x_0 + h v_0. Drag is implicit, too. A step whose residual stays above the tolerance is undone and taken in two, four,
// eight parts of backward Euler; what is still above it then is counted, and goes on from the best state found. If
// that is very far from equilibrium, or faster than tissue may be, Newton's method has lost its way: for that part the
// tissue stands still, but for what the smoother improves, without speed; where that is so for all parts, nobody knows
// the force on the hand.
#pragma once

#include <algorithm>
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
    bool is_long = false;  // BDF2, to NewtonStep::kLongTolerance
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

  // Particles from this one on have no past: they are new, or have jumped. 0: the next step is the first one.
  void forget(std::size_t from = 0) {
    before_position_.resize(std::min(before_position_.size(), from));
    if (from == 0) newton_.begin_with({});
  }

  double residual() const { return residual_; }             // residual by force in the last step: largest of its parts
  double residual_m() const { return residual_m_; }         // how far the last iteration moved something
  std::uint64_t steps_not_met() const { return not_met_; }  // steps so far that missed the tolerance
  int parts() const { return parts_; }                      // parts of the last step
  int iterations() const { return iterations_; }            // iterations of Newton's method in the last step
  int products() const { return products_; }                // products with Hessians in the last step

  template <class A>
  void archive(A& a) {
    a(residual_, residual_m_, not_met_, parts_, iterations_, products_, before_position_, before_velocity_,
      left_position_, left_velocity_, newton_);
  }

 private:
  static constexpr int kMostParts = 8;
  // Bounds one attempt at a step: tissue that hangs by a thread would take any number of products.
  static constexpr int kMostProducts = 250;

  static constexpr double kNear = 0.2;   // a residual below this is nearly met
  static constexpr double kLost = 1000;  // from this residual on, Newton's method has lost its way
  enum class Ending : std::uint8_t { only_when_met, anyhow };

  // A part of a step: its length, H, and the shares of the speed that are left after H and after its length.
  struct Part {
    double step_s, length_s, kept_s, start_s;
    bool has_past;
    Vec3 fall_m;
  };
  void look_back(double step_s);
  void begin_part(const Part& part, const Particles& particles);
  void end_part(const Part& part, const Particles& particles, double furthest_m);
  bool is_thrown(const Particles& particles, double furthest_m) const;
  void stand_still(const Particles& particles, double furthest_m, double part_s, const Smoother& smoother);
  bool take(ElasticEnergy& energy, const Motion& motion, const Particles& particles,
            std::span<const PointConstraint> constraints, const ConstraintSupports& supports,
            std::span<Reaction> reactions, int parts, Ending ending, const Smoother& smoother);

  NewtonStep newton_;
  std::vector<Vec3> inertial_, now_;
  std::vector<Vec4f> start_position_, start_velocity_;
  std::vector<Vec4f> before_position_, before_velocity_;  // a step ago; empty: nothing is known
  std::vector<Vec4f> left_position_, left_velocity_;      // after the last step
  std::vector<Vec3> base_;                                // X
  std::vector<PointConstraint> part_;
  std::vector<Vec3> from_, taken_along_;
  std::vector<Reaction> of_part_;
  double residual_ = 0, residual_m_ = 0;
  std::uint64_t not_met_ = 0;
  int parts_ = 1, iterations_ = 0, products_ = 0;
};

}  // namespace sectio

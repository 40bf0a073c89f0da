// What models of solids with an explicit and an implicit driver have in common. The explicit one takes a step in equal
// parts, watched by a bound on the largest frequency. A step that it could not take safely is taken back and done by
// block descent, implicit and stable at any step; then the explicit one goes on.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "sim_server/deformation/tetra/volume_model.h"

namespace sectio {

enum class TetDriver { automatic, implicit_only };

class ExplicitImplicitIntegrator : public VolumeModel {
 public:
  ExplicitImplicitIntegrator(const VolumeMaterial& material, VolumeSettings settings, TetDriver driver)
      : VolumeModel(material, std::move(settings)), driver_(driver) {}

  // Parts of a step for the explicit driver, and the longest one that is stable at rest.
  int parts() const { return parts_; }
  double explicit_limit_s() const { return explicit_limit_s_; }
  // Of the last step: the largest stable part over the part taken, as the bound has it. Above 1 while explicit.
  double margin() const override { return was_implicit_ ? HUGE_VAL : margin_; }
  // implicit_steps() counts those that the explicit driver gave up.
  bool last_step_was_implicit() const { return was_implicit_; }
  std::uint64_t implicit_steps() const override { return implicit_steps_; }
  double residual_m() const override { return was_implicit_ ? residual_m_ : 0; }

 protected:
  static constexpr double kLeastMargin = 1.1;  // between two looks at the bound
  static constexpr int kBoundEvery = 8;        // parts of a step between these
  static constexpr int kSweeps = 30;
  static constexpr double kStill_m = 1e-8;  // sweeps that move no particle further are enough

  TetDriver driver_;
  double explicit_limit_s_ = 0;
  int parts_ = 1;
  double margin_ = 0, residual_m_ = 0;
  bool was_implicit_ = false;
  std::uint64_t implicit_steps_ = 0;
};

// Where an implicit step of length h begins, from where a particle is: y = x + (1 - alpha h) h v + h^2 g is where it
// would go without forces, and x + (1 - alpha h) h v + s h^2 g the first guess, with as much of gravity's pull as it
// followed in the last step: none where it is at rest.
class ImplicitStart {
 public:
  ImplicitStart(double step_s, double damping_per_s, const Vec3& gravity_m_per_s2)
      : h_(step_s), damping_per_s_(damping_per_s), g_(gravity_m_per_s2), g2_(g_.squaredNorm()) {}

  struct Ways {
    Vec3 inertial_m, guess_m;
  };
  Ways of(const Vec3& velocity_m_per_s, const Vec3& last_velocity_m_per_s) const {
    const Vec3 drift = (1 - damping_per_s_ * h_) * h_ * velocity_m_per_s;
    const Vec3 acceleration = (velocity_m_per_s - last_velocity_m_per_s) / h_;
    const double share = g2_ > 0 ? std::clamp(acceleration.dot(g_) / g2_, 0.0, 1.0) : 0;
    return {drift + h_ * h_ * g_, drift + share * h_ * h_ * g_};
  }

 private:
  double h_, damping_per_s_;
  Vec3 g_;
  double g2_;
};

// The way of a particle in a step, cut back to what kMaxVolumeSpeed_m_per_s allows; nothing when it isn't finite.
inline std::optional<Vec3> within_speed(const Vec3& way_m, double step_s) {
  const double furthest = kMaxVolumeSpeed_m_per_s * step_s, distance = way_m.norm();
  if (!std::isfinite(distance)) return std::nullopt;
  return distance > furthest ? Vec3((furthest / distance) * way_m) : way_m;
}

}  // namespace sectio

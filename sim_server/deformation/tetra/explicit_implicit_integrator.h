// The base of solids with an explicit and an implicit integrator. The explicit one takes a step in equal substeps and
// monitors a bound on the largest frequency. A step that it can't take safely is undone and taken by vertex block
// descent, which is implicit and stable at any step; then the explicit integrator goes on.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "sim_server/deformation/tetra/volume_model.h"

namespace sectio {

enum class VolumeIntegrator { automatic, implicit_only };

class ExplicitImplicitIntegrator : public VolumeModel {
 public:
  ExplicitImplicitIntegrator(const VolumeMaterial& material, VolumeSettings settings, VolumeIntegrator integrator)
      : VolumeModel(material, std::move(settings)), integrator_(integrator) {}

  // Explicit substeps of a step, and the length of the largest one that is stable at rest.
  int substeps() const { return substeps_; }
  double explicit_limit_s() const { return explicit_limit_s_; }
  bool last_step_was_implicit() const { return was_implicit_; }
  IntegratorDiagnostics diagnostics() const override {
    IntegratorDiagnostics d;
    d.implicit_steps = implicit_steps_;
    if (was_implicit_)
      d.residual_m = residual_m_;
    else
      d.stability_margin = margin_;
    return d;
  }

 protected:
  static constexpr double kLeastMargin = 1.1;  // leaves room for growth until the next evaluation of the bound
  static constexpr int kBoundEvery = 8;        // substeps between evaluations of the bound
  static constexpr int kSweeps = 30;
  static constexpr double kStill_m = 1e-8;  // sweeps end when none moves a particle further

  VolumeIntegrator integrator_;
  double explicit_limit_s_ = 0;
  int substeps_ = 1;
  double margin_ = 0, residual_m_ = 0;
  bool was_implicit_ = false;
  std::uint64_t implicit_steps_ = 0;
};

// The start of an implicit step of length h for a particle at x: the inertial position y = x + (1 - alpha h) h v + h^2
// g, and the initial guess x + (1 - alpha h) h v + s h^2 g, where s is the share of gravity that the particle followed
// in the last step: 0 for a particle at rest (adaptive warm start, Chen et al. 2024).
class ImplicitStart {
 public:
  ImplicitStart(double step_s, double damping_per_s, const Vec3& gravity_m_per_s2)
      : h_(step_s), damping_per_s_(damping_per_s), g_(gravity_m_per_s2), g2_(g_.squaredNorm()) {}

  struct Displacements {
    Vec3 inertial_m, guess_m;
  };
  Displacements displacements(const Vec3& velocity_m_per_s, const Vec3& last_velocity_m_per_s) const {
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

// The displacement of a particle in a step, limited to kMaxVolumeSpeed_m_per_s; nothing if it isn't finite.
inline std::optional<Vec3> within_speed(const Vec3& displacement_m, double step_s) {
  const double furthest = kMaxVolumeSpeed_m_per_s * step_s, distance = displacement_m.norm();
  if (!std::isfinite(distance)) return std::nullopt;
  return distance > furthest ? Vec3((furthest / distance) * displacement_m) : displacement_m;
}

}  // namespace sectio

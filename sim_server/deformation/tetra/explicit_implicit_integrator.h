// The base of solids with an explicit and an implicit integrator. The explicit one takes a step in equal substeps and
// monitors a bound on the largest frequency. A step that it can't take safely is undone and taken by the implicit
// driver, which is stable at any step; then the explicit integrator goes on.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include "sim_server/deformation/implicit_driver.h"
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
  void use_stable_driver(int steps) override { stable_for_ = std::max(stable_for_, steps); }
  bool last_step_was_implicit() const { return was_implicit_; }
  ModelSize size() const override {
    ModelSize size = VolumeModel::size();
    size.parts = substeps_, size.part_limit_s = explicit_limit_s_;
    return size;
  }
  IntegratorDiagnostics diagnostics() const override {
    IntegratorDiagnostics d;
    d.implicit_steps = implicit_steps_;
    d.steps_not_met = driver_.steps_not_met();
    if (was_implicit_) {
      d.residual = driver_.residual();
      d.residual_m = driver_.residual_m();
    } else {
      d.stability_margin = margin_;
    }
    return d;
  }

 protected:
  void archive_integrator(Archive& a) {
    archive_settings(a);
    a(explicit_limit_s_, substeps_, margin_, was_implicit_, driver_, stable_for_, implicit_steps_);
  }
  ImplicitDriver::Motion motion() const {
    return {settings_.step_s, material_.damping_per_s, settings_.gravity_m_per_s2, kMaxSpeed_m_per_s,
            integrator_ == VolumeIntegrator::implicit_only};
  }
  // Whether the explicit driver need not be asked for this step.
  bool begins_implicit() {
    return integrator_ == VolumeIntegrator::implicit_only || (stable_for_ > 0 && stable_for_-- > 0);
  }
  static constexpr double kLeastMargin = 1.1;  // leaves room for growth until the next evaluation of the bound
  static constexpr int kBoundEvery = 8;        // substeps between evaluations of the bound
  static constexpr int kSmoothing = 5;         // sweeps of block descent over a wreck

  VolumeIntegrator integrator_;
  double explicit_limit_s_ = 0;
  int substeps_ = 1;
  double margin_ = 0;
  bool was_implicit_ = false;
  ImplicitDriver driver_;
  int stable_for_ = 0;  // steps that the implicit driver takes whatever the bound says
  std::uint64_t implicit_steps_ = 0;
};

}  // namespace sectio

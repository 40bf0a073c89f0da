#include "sim_server/world/model_check.h"

#include <algorithm>
#include <cmath>

namespace sectio {
namespace {

constexpr std::uint64_t kEnergyEvery = 256;  // steps: it takes about as long as one
constexpr double kOfLate_s = 0.5;

// The largest norm of the first three entries, if it is above `known`; else `known`. The first loop decides most calls.
double largest_norm(std::span<const Vec4f> entries, double known) {
  Vec4f largest = Vec4f::Zero();
  for (const Vec4f& u : entries) largest = largest.cwiseMax(u.cwiseAbs());
  if (largest.head<3>().norm() <= known) return known;
  for (const Vec4f& u : entries) known = std::max<double>(known, u.head<3>().norm());
  return known;
}

}  // namespace

void ModelCheck::stepped(Body& body, double step_s, double work_j, bool disturbed, double took_s) {
  const double share = std::min(1.0, std::max(step_s / kOfLate_s, 1.0 / static_cast<double>(++steps_)));
  processor_s_ += took_s;
  check_.cpu += share * (took_s / step_s - check_.cpu);
  check_.asleep = body.asleep();
  if (check_.asleep) known_ = false;
  if (!body.deforms() || body.frozen || check_.asleep) return;
  largest_speed_m_per_s_ = largest_norm(body.shared().particles.velocity_world_m_per_s, largest_speed_m_per_s_);
  const DeformationEngine& deformation = *body.engines.deformation;
  const IntegratorDiagnostics diagnostics = deformation.diagnostics();
  check_.stability_margin = std::min(kMostMargin, diagnostics.stability_margin);
  check_.residual_m = std::isfinite(diagnostics.residual_m) ? diagnostics.residual_m : 0;
  check_.implicit_steps = diagnostics.implicit_steps;
  if (disturbed) known_ = false;
  work_j_ += work_j;
  is_due_ |= steps_ % kEnergyEvery == 0;
  if (!is_due_ || disturbed) return;
  is_due_ = false;
  const double energy_j = deformation.energy_j(body.shared());
  if (known_ && std::isfinite(energy_j))
    check_.energy_gain_j = std::max(check_.energy_gain_j, energy_j - energy_j_ - work_j_);
  energy_j_ = energy_j;
  work_j_ = 0;
  known_ = std::isfinite(energy_j);
}

}  // namespace sectio

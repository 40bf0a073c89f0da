#include "sim_server/deformation/held_points.h"

#include <Eigen/LU>
#include <algorithm>

#include "common/core/error.h"

namespace sectio {
namespace {

// The part of a force that the constraint may exert: a unilateral constraint only pushes, and only along its normal
// unless it sticks.
Vec3 allowed(const PointConstraint& c, const Vec3& force_n) {
  if (c.unilateral) {
    const double push = std::min(0.0, force_n.dot(c.normal));
    return c.sticks && push < 0 ? force_n : Vec3(push * c.normal);
  }
  const double size_n = force_n.norm();
  return size_n > c.largest_force_n ? Vec3(c.largest_force_n / size_n * force_n) : force_n;
}

}  // namespace

void HeldPoints::begin(std::span<const PointConstraint> constraints, const ConstraintSupports& supports,
                       std::span<const double> inverse_mass, double step_s) {
  constraints_ = constraints;
  supports_ = &supports;
  inverse_mass_ = inverse_mass;
  step_s_ = step_s;
  on_tissue_n_.assign(constraints.size(), Vec3::Zero());
}

bool HeldPoints::put(const Particles& particles) {
  bool any = false;
  for (std::size_t n = 0; n < constraints_.size(); ++n) {
    const PointConstraint& c = constraints_[n];
    const auto by = supports_->of(n);
    share_.assign(by.size(), Mat3::Zero());  // w_a H_a^-1
    Mat3 compliance = Mat3::Zero();
    Vec3 missing = c.target_world_m;
    for (std::size_t a = 0; a < by.size(); ++a) {
      missing -= by[a].weight * particles.position_world_m(by[a].particle);
      if (by[a].weight == 0 || inverse_mass_[by[a].particle] == 0) continue;
      share_[a] = by[a].weight * particles.block_n_per_m(by[a].particle).inverse();
      compliance += by[a].weight * share_[a];
    }
    if (!(compliance.trace() > 0)) continue;
    const Vec3 more = allowed(c, on_tissue_n_[n] + compliance.inverse() * missing) - on_tissue_n_[n];
    if (more.isZero(0)) continue;
    on_tissue_n_[n] += more;
    for (std::size_t a = 0; a < by.size(); ++a)
      particles.move(by[a].particle, share_[a] * more,
                     step_s_ * step_s_ * by[a].weight * inverse_mass_[by[a].particle] * more);
    any = true;
  }
  return any;
}

void HeldPoints::finish(std::span<Vec4f> velocity_m_per_s, std::span<Reaction> reactions) const {
  SECTIO_ASSERT(reactions.size() == constraints_.size(), "one reaction a constraint");
  for (std::size_t n = 0; n < constraints_.size(); ++n) {
    Vec3 velocity = Vec3::Zero();
    for (const auto& [particle, weight] : supports_->of(n))
      velocity += weight * velocity_m_per_s[particle].head<3>().cast<double>();
    const Vec3& force = on_tissue_n_[n];
    reactions[n] = {-force, !force.isZero(0), step_s_ * force.dot(velocity)};
    if (!constraints_[n].stops || !reactions[n].active) continue;
    for (const auto& [particle, weight] : supports_->of(n)) velocity_m_per_s[particle].setZero();
  }
}

}  // namespace sectio

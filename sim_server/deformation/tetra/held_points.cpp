#include "sim_server/deformation/tetra/held_points.h"

#include <algorithm>
#include <array>

#include "common/core/error.h"

namespace sectio {
namespace {

Vec3 point_of(const PointConstraint& c, std::span<const Vec4f> what) {
  Vec3 point = Vec3::Zero();
  for (std::size_t a = 0; a < 3; ++a)
    if (c.v[a] != kNone) point += c.w[a] * what[c.v[a]].head<3>().cast<double>();
  return point;
}

// What a constraint may do of that: one that is unilateral pushes, along its normal if it doesn't stick.
Vec3 allowed(const PointConstraint& c, const Vec3& force_n) {
  if (c.unilateral) {
    const double push = std::min(0.0, force_n.dot(c.normal));
    return c.sticks && push < 0 ? force_n : Vec3(push * c.normal);
  }
  const double size_n = force_n.norm();
  return size_n > c.largest_force_n ? Vec3(c.largest_force_n / size_n * force_n) : force_n;
}

}  // namespace

void HeldPoints::begin(std::span<const PointConstraint> constraints, std::span<const double> inverse_mass,
                       double step_s) {
  constraints_ = constraints;
  inverse_mass_ = inverse_mass;
  step_s_ = step_s;
  on_tissue_n_.assign(constraints.size(), Vec3::Zero());
}

bool HeldPoints::put(const Block& block_n_per_m, std::span<Vec4f> position_world_m, std::span<Vec4f> inertial_world_m) {
  bool any = false;
  for (std::size_t n = 0; n < constraints_.size(); ++n) {
    const PointConstraint& c = constraints_[n];
    std::array<Mat3, 3> share;  // w_a H_a^-1
    Mat3 compliance = Mat3::Zero();
    for (std::size_t a = 0; a < 3; ++a) {
      share[a].setZero();
      if (c.v[a] == kNone || c.w[a] == 0 || inverse_mass_[c.v[a]] == 0) continue;
      share[a] = c.w[a] * block_n_per_m(c.v[a]).inverse();
      compliance += c.w[a] * share[a];
    }
    if (!(compliance.trace() > 0)) continue;
    const Vec3 missing = c.target_world_m - point_of(c, position_world_m);
    const Vec3 wanted = on_tissue_n_[n] + compliance.inverse() * missing;
    const Vec3 more = allowed(c, wanted) - on_tissue_n_[n];
    on_tissue_n_[n] += more;
    if (more.isZero(0)) continue;
    for (std::size_t a = 0; a < 3; ++a) {
      if (c.v[a] == kNone) continue;
      position_world_m[c.v[a]].head<3>() += (share[a] * more).cast<float>();
      inertial_world_m[c.v[a]].head<3>() += (step_s_ * step_s_ * c.w[a] * inverse_mass_[c.v[a]] * more).cast<float>();
    }
    any = true;
  }
  return any;
}

void HeldPoints::finish(std::span<Vec4f> velocity_m_per_s, std::span<Reaction> reactions) const {
  SECTIO_ASSERT(reactions.size() == constraints_.size(), "one reaction a constraint");
  for (std::size_t n = 0; n < constraints_.size(); ++n) {
    const PointConstraint& c = constraints_[n];
    const Vec3& force = on_tissue_n_[n];
    const bool active = !force.isZero(0);
    reactions[n] = {-force, active, step_s_ * force.dot(point_of(c, velocity_m_per_s))};
    for (std::size_t a = 0; c.stops && active && a < 3; ++a)
      if (c.v[a] != kNone) velocity_m_per_s[c.v[a]].setZero();
  }
}

}  // namespace sectio

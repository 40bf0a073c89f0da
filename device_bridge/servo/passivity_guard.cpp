#include "device_bridge/servo/passivity_guard.h"

#include <algorithm>

namespace sectio {
namespace {

// The tool may be in the tissue when the first model comes. The energy of the spring that appears then is not counted.
constexpr double kBeginning_s = 2 * ContactModelFollower::kBlend_s;

}  // namespace

Vec3 PassivityGuard::tick(const Vec3& position_world_m, const Vec3& velocity_world_m_per_s, double dt_s,
                          const ContactModel* model, const Vec3& force_world_n) {
  if (model == nullptr || dt_s <= 0) {
    last_position_m_ = position_world_m;
    return force_world_n;
  }
  const Vec3& plane_m_per_s = model->velocity_world_m_per_s;
  // The mean of both ends. The bound on stiffness covers the energy that a force held for a period gives away.
  given_j_ += 0.5 * (last_force_n_ + force_world_n).dot(position_world_m - last_position_m_ - plane_m_per_s * dt_s);
  const double normal_n = model->normal_world.dot(force_world_n);
  stored_j_ = model->stiffness_n_per_m > 0 ? normal_n * normal_n / (2 * model->stiffness_n_per_m) : 0;

  if (began_s_ < kBeginning_s) given_j_ = -stored_j_;
  began_s_ += dt_s;

  // An excess is forgiven towards zero; a surplus is kept up to the reserve.
  if (excess_j() > 0) given_j_ -= std::min(excess_j(), spec_.refill_w * dt_s);
  given_j_ = std::max(given_j_, -spec_.reserve_j - stored_j_);

  const Vec3 relative = velocity_world_m_per_s - plane_m_per_s;
  const double wanted = std::max(0.0, excess_j() - spec_.tank_j) / (relative.squaredNorm() * spec_.onset_s + 1e-9);
  const double change = spec_.damping_n_s_per_m * dt_s / spec_.onset_s;
  damping_n_s_per_m_ =
      std::clamp(std::min(wanted, spec_.damping_n_s_per_m), damping_n_s_per_m_ - change, damping_n_s_per_m_ + change);
  last_position_m_ = position_world_m;
  last_force_n_ = force_world_n - damping_n_s_per_m_ * relative;
  return last_force_n_;
}

}  // namespace sectio

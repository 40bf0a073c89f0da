#include "device_bridge/device/hand_mass.h"

namespace sectio {

// m dv/dt = F + K (w - x) + B (dw/dt - v) - b v, dampers implicit: stable for any B + b.
void HandMass::step(const Vec3& wish_m, const Vec3& next_wish_m) {
  const double h = kStep_s;
  const Vec3 wish_velocity = (next_wish_m - wish_m) / h;
  const Vec3 drive =
      force_n_ + spec_.hand_stiffness_n_per_m * (wish_m - position_m_) + spec_.hand_damping_n_s_per_m * wish_velocity;
  const double damping = spec_.device_damping_n_s_per_m + spec_.hand_damping_n_s_per_m;
  velocity_m_per_s_ = (spec_.device_mass_kg * velocity_m_per_s_ + h * drive) / (spec_.device_mass_kg + h * damping);
  position_m_ += h * velocity_m_per_s_;
}

}  // namespace sectio

// A limit on the energy that the loop through the wire may give to the hand: the last resort when the local model is
// wrong (Hannaford & Ryu 2002, as a tank that is only drawn on, never the primary method).
#pragma once

#include "common/math/contact_model.h"

namespace sectio {

struct GuardSpec {
  double tank_j = 0.005;          // energy that the hand may get in excess before the guard acts
  double refill_w = 0.001;        // rate at which an excess is forgiven
  double reserve_j = 0.001;       // the most that is kept of the energy that friction and cutting have taken
  double damping_n_s_per_m = 10;  // the largest damping
  double onset_s = 0.01;          // time within which an excess is damped away, and damping rises and falls
};

// Counts the work on the hand relative to the moving plane (an organ that breathes may push) and the energy stored in
// the model's spring. A passive tissue never lets their sum grow; growth beyond the tank is damped away. No allocation,
// no lock.
class PassivityGuard {
 public:
  explicit PassivityGuard(const GuardSpec& spec = {}) : spec_(spec) {}

  // The force to apply instead of `force_world_n`; `model` null: nothing to guard.
  Vec3 tick(const Vec3& position_world_m, const Vec3& velocity_world_m_per_s, double dt_s, const ContactModel* model,
            const Vec3& force_world_n);

  double excess_j() const { return given_j_ + stored_j_; }

 private:
  GuardSpec spec_;
  double began_s_ = 0;  // time since the first model
  double given_j_ = 0;
  double stored_j_ = 0;
  double damping_n_s_per_m_ = 0;
  Vec3 last_position_m_ = Vec3::Zero();
  Vec3 last_force_n_ = Vec3::Zero();
};

}  // namespace sectio

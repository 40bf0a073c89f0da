// Gravity in the frame of the patient, which turns when the table is tilted: by the scene's plan (gravity_changes) and
// on request (StepInput).
#pragma once

#include <optional>
#include <vector>

#include "sim_server/scene/scene.h"
#include "sim_server/world/step_io.h"

namespace sectio {

// One step from `now` towards `target`: turned by max_rad at most, made stronger or weaker by max_m_per_s2 at most.
// Opposite directions are turned into each other always the same way round. The last step gives `target` exactly. Uses
// no function of libm but square roots, for the same bits everywhere.
Vec3 turned_towards(const Vec3& now, const Vec3& target, double max_rad, double max_m_per_s2);

class TurningGravity {
 public:
  explicit TurningGravity(const Scene& scene);

  // Sets the gravity of the step that ends at sim_time_s. True when it changed; a new target makes an event.
  bool step(const StepInput& input, StepOutput& output);
  const Vec3& now() const { return now_; }
  const Vec3& target() const { return target_; }

  template <class A>
  void archive(A& a) {
    a(next_, now_, target_);
  }

 private:
  std::vector<GravityChange> changes_;
  std::size_t next_ = 0;
  double max_rad_, max_m_per_s2_;  // in a step
  Vec3 now_, target_;
};

}  // namespace sectio

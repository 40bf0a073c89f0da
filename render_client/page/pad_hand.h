// A pad as a hand: sticks and triggers are speeds, seen from the camera. The wish goes on from where the instrument is,
// and never runs away from an instrument that tissue holds up. Time is passed in.
#pragma once

#include <optional>

#include "common/math/types.h"
#include "render_client/draw/orbit_camera.h"

namespace sectio {

// Shares of full speed, -1 to 1, in the directions of a person who looks through the camera.
struct PadState {
  double right = 0, away = 0, up = 0;
  double roll = 0, pitch = 0;
  bool closes = false;  // jaws
  bool slow = false;
  bool moves() const { return right != 0 || away != 0 || up != 0 || roll != 0 || pitch != 0 || closes; }
};

class PadHand {
 public:
  static constexpr double kSpeed_m_per_s = 0.05;
  static constexpr double kTurn_rad_per_s = 1.5;
  static constexpr double kSlow = 0.2;
  static constexpr double kLeash_m = 0.03;
  static constexpr double kWidest_rad = 0.6;
  static constexpr double kJaws_rad_per_s = 1.5;

  void push(const PadState& state) { state_ = state; }
  // `instrument`: its pose; nothing when it isn't drawn.
  void tick(double now_s, const std::optional<JointPose>& instrument, const Camera& camera);
  const std::optional<JointPose>& wish() const { return wish_; }

 private:
  PadState state_;
  std::optional<JointPose> wish_;
  std::optional<double> last_s_;
};

}  // namespace sectio

// A person with a headset and a controller. The room is that of WebXR: metres, y up, -z ahead; its origin is where the
// head was at first. The scene stands in it as large as a person sees well, ahead of the chest, its ground level, seen
// from the side from which the scene's camera sees it. A controller is the instrument: it reaches ahead of the hand as
// a pen does.
#pragma once

#include <optional>

#include "render_client/draw/camera.h"
#include "render_client/draw/orbit_camera.h"

namespace sectio {

// A controller at one moment. Its grip, as WebXR has it: -z along the rod that a hand holds, out at the thumb.
struct Controller {
  Pose grip_room;
  double closed = 0;     // the jaws, 0 to 1: the trigger
  bool carries = false;  // the hand moves the scene instead of the instrument
};

class Headset {
 public:
  static constexpr double kSeen_m = 0.45;  // in the room: the height of what the camera's picture shows
  static constexpr double kReach_m = 0.1;  // from the hand to the instrument's tip, in the room
  static constexpr double kWidest_rad = 0.6;

  explicit Headset(const Camera& camera);

  // Matrices as WebXR gives them. The eye's view is in metres of the world.
  EyeView eye(const Eigen::Matrix4f& eye_from_room, const Eigen::Matrix4f& projection) const;
  void lead(const Controller& controller);
  // Nothing before a controller was there.
  const std::optional<JointPose>& wish() const { return wish_; }

 private:
  Vec3 to_world(const Vec3& room_m) const {
    return target_world_m_ + world_from_room_ * (room_m - target_room_m_) / scale_;
  }

  Vec3 target_world_m_;
  Vec3 target_room_m_{0, -0.3, -0.5};
  Mat3 world_from_room_;
  double scale_;  // way in the room over way in the world
  std::optional<JointPose> wish_;
  std::optional<Vec3> carried_from_room_m_;
};

}  // namespace sectio

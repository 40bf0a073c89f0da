#include "render_client/page/headset.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sectio {

namespace {

double seen_world_m(const Camera& camera) {
  const double distance_m = std::max((camera.eye_world_m - camera.target_world_m).norm(), 1e-3);
  return 2 * distance_m * std::tan(0.5 * camera.field_of_view_deg * std::numbers::pi / 180);
}

// The room's axes are right, up and back.
Mat3 room_axes(const Camera& camera) {
  const Mat3 level = level_axes(camera);
  Mat3 axes;
  axes << level.col(0), level.col(2), -level.col(1);
  return axes;
}

// The tool's frame: z up its shaft, x where the sharp edge points, which is beneath a pen.
Mat3 grip_from_tool() {
  Mat3 axes;
  axes << 0, 1, 0, -1, 0, 0, 0, 0, 1;
  return axes;
}

}  // namespace

Headset::Headset(const Camera& camera)
    : target_world_m_(camera.target_world_m),
      world_from_room_(room_axes(camera)),
      scale_(kSeen_m / seen_world_m(camera)) {}

// To show the scene s times as large, the eyes' distances and the range of depth in the world are divided by s.
EyeView Headset::eye(const Eigen::Matrix4f& eye_from_room, const Eigen::Matrix4f& projection) const {
  const auto shrink = static_cast<float>(1 / scale_);
  const Eigen::Matrix3f room_from_world = world_from_room_.transpose().cast<float>();
  const Vec3 origin_room_m = target_room_m_ - scale_ * (world_from_room_.transpose() * target_world_m_);
  EyeView view{Eigen::Matrix4f::Identity(), projection};
  view.view_from_world.topLeftCorner<3, 3>() = eye_from_room.topLeftCorner<3, 3>() * room_from_world;
  view.view_from_world.topRightCorner<3, 1>() =
      shrink * (eye_from_room * origin_room_m.cast<float>().homogeneous()).head<3>();
  view.projection.col(3) *= shrink;
  return view;
}

void Headset::lead(const Controller& controller) {
  const Pose& grip = controller.grip_room;
  if (controller.carries) {
    if (carried_from_room_m_) target_room_m_ += grip.position_m - *carried_from_room_m_;
    carried_from_room_m_ = grip.position_m;
    return;
  }
  carried_from_room_m_.reset();
  const Vec3 tip_room_m = grip.to_world(Vec3(0, 0, -kReach_m));
  const Eigen::Quaterniond in_room = grip.orientation * Eigen::Quaterniond(grip_from_tool());
  const double opening_rad = kWidest_rad * (1 - std::clamp(controller.closed, 0.0, 1.0));
  wish_ = JointPose{{to_world(tip_room_m), (Eigen::Quaterniond(world_from_room_) * in_room).normalized()}, opening_rad};
}

}  // namespace sectio

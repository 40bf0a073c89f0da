#include "render_client/window/viewpoint.h"

namespace sectio {

void Viewpoint::apply(const WindowInput& input) {
  halted_ = halted_ != input.halts;
  wireframe_ = wireframe_ != input.wireframe;
  if (input.follows) {
    followed_ = followed_ == input.follows ? std::nullopt : input.follows;
    followed_world_m_.reset();
  }
  if (!camera_) return;
  if (input.section) section_ = section_ ? std::nullopt : std::optional(section_at_target(camera_->camera()));
  if (section_) section_->point_world_m += input.section_nearer_m * section_->normal_world;
  if (input.home) camera_ = first_;
  camera_->orbit(input.turn_right_rad, input.turn_up_rad);
  camera_->pan(input.move_right, input.move_up);
  camera_->zoom(input.nearer);
}

void Viewpoint::look(Frame& frame) {
  if (!camera_) first_ = camera_ = OrbitCamera(frame.camera);
  if (followed_ && *followed_ < frame.tools.size() && frame.tools[*followed_].present) {
    const Vec3& at_world_m = frame.tools[*followed_].pose_world.position_m;
    if (followed_world_m_) camera_->move(at_world_m - *followed_world_m_);
    followed_world_m_ = at_world_m;
  }
  frame.camera = camera_->camera();
}

}  // namespace sectio

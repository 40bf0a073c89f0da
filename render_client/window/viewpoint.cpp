#include "render_client/window/viewpoint.h"

#include <algorithm>
#include <set>

namespace sectio {

void WindowInput::add(const WindowInput& later) {
  turn_right_rad += later.turn_right_rad;
  turn_up_rad += later.turn_up_rad;
  move_right += later.move_right;
  move_up += later.move_up;
  nearer *= later.nearer;
  section_nearer_m += later.section_nearer_m;
  for (bool WindowInput::*toggle :
       {&WindowInput::halts, &WindowInput::wireframe, &WindowInput::full_screen, &WindowInput::stereo,
        &WindowInput::panel, &WindowInput::section, &WindowInput::pauses})
    this->*toggle = this->*toggle != later.*toggle;
  for (bool WindowInput::*wish : {&WindowInput::home, &WindowInput::keeps_picture, &WindowInput::closes,
                                  &WindowInput::next_field, &WindowInput::goes_back})
    this->*wish = this->*wish || later.*wish;
  if (later.follows) follows = later.follows;
  if (later.field) field = later.field;
  if (later.goes_to_s) goes_to_s = later.goes_to_s;
}

void Viewpoint::apply(const WindowInput& input) {
  halted_ = halted_ != input.halts;
  options_.wireframe = options_.wireframe != input.wireframe;
  options_.stereo = options_.stereo != input.stereo;
  options_.panel = options_.panel != input.panel;
  choose_field(input);
  if (input.follows) {
    followed_ = followed_ == input.follows ? std::nullopt : input.follows;
    followed_world_m_.reset();
  }
  if (!camera_) return;
  if (input.section) {
    section_ = section_ ? std::nullopt : std::optional(section_at_target(camera_->camera()));
    section_depth_m_ = 0;
  }
  if (section_) {
    section_->point_world_m += input.section_nearer_m * section_->normal_world;
    section_depth_m_ -= input.section_nearer_m;
  }
  if (input.home) camera_ = first_;
  camera_->orbit(input.turn_right_rad, input.turn_up_rad);
  camera_->pan(input.move_right, input.move_up);
  camera_->zoom(input.nearer);
}

void Viewpoint::choose_field(const WindowInput& input) {
  if (input.field) options_.field = *input.field;
  if (!input.next_field) return;
  const auto next = std::ranges::upper_bound(fields_, options_.field);
  options_.field = next == fields_.end() ? "" : *next;
}

void Viewpoint::look(Frame& frame) {
  if (!camera_) {
    first_ = camera_ = OrbitCamera(frame.camera);
    if (options_.section) section_ = section_at_target(frame.camera);
  }
  if (followed_ && *followed_ < frame.tools.size() && frame.tools[*followed_].present) {
    const Vec3& at_world_m = frame.tools[*followed_].pose_world.position_m;
    if (followed_world_m_) camera_->move(at_world_m - *followed_world_m_);
    followed_world_m_ = at_world_m;
  }
  frame.camera = camera_->camera();
  std::set<std::string> names;
  for (const BodyFrame& body : frame.bodies)
    for (const ScalarField& field : body.scalars) names.insert(field.name);
  fields_.assign(names.begin(), names.end());
}

double Viewpoint::distance_m() const {
  return camera_ ? (camera_->camera().eye_world_m - camera_->camera().target_world_m).norm() : 0;
}

}  // namespace sectio

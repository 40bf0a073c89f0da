// The view of a person at a window: a camera to turn, a picture to halt, an instrument to follow. Pure values; the
// window itself is window.h.
#pragma once

#include <cstddef>
#include <optional>

#include "render_client/draw/camera.h"
#include "render_client/draw/orbit_camera.h"
#include "render_client/replica/frame.h"

namespace sectio {

// All that a person has done at a window since it was last asked.
struct WindowInput {
  double turn_right_rad = 0, turn_up_rad = 0;
  double move_right = 0, move_up = 0;           // in heights of the picture
  double nearer = 1;                            // the factor of the distance
  bool halts = false;                           // the picture, or lets it go on
  bool wireframe = false, full_screen = false;  // on or off
  bool section = false;                         // on, facing the person, or off
  double section_nearer_m = 0;                  // the plane moves towards where it faced
  bool home = false;                            // the scene's own view
  bool keeps_picture = false;
  bool closes = false;
  std::optional<std::size_t> follows = {};  // this instrument, or no longer
};

class Viewpoint {
 public:
  void apply(const WindowInput& input);
  // Gives the frame this camera; the first frame gives its own.
  void look(Frame& frame);

  bool halted() const { return halted_; }
  bool wireframe() const { return wireframe_; }
  const std::optional<SectionPlane>& section() const { return section_; }

 private:
  std::optional<OrbitCamera> first_, camera_;
  std::optional<std::size_t> followed_;  // an instrument, with which the camera moves
  std::optional<Vec3> followed_world_m_;
  bool halted_ = false;
  bool wireframe_ = false;
  std::optional<SectionPlane> section_;
};

}  // namespace sectio

// The view of a person at a window: a camera to turn, a picture to halt, an instrument to follow. Pure values; the
// window itself is window.h.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "render_client/draw/camera.h"
#include "render_client/draw/orbit_camera.h"
#include "render_client/replica/frame.h"

namespace sectio {

constexpr double kBackInTime_s = 10;  // simulated

// All that a person has done at a window since it was last asked.
struct WindowInput {
  double turn_right_rad = 0, turn_up_rad = 0;
  double move_right = 0, move_up = 0;           // in heights of the largest picture of 4:3 that fits
  double nearer = 1;                            // the factor of the distance
  bool halts = false;                           // the picture, or lets it go on
  bool wireframe = false, full_screen = false;  // on or off
  bool stereo = false, panel = false;           // likewise
  bool section = false;                         // on, facing the person, or off
  double section_nearer_m = 0;                  // the plane moves towards where it faced
  bool home = false;                            // the scene's own view
  bool keeps_picture = false;
  bool closes = false;
  std::optional<std::size_t> follows = {};  // this instrument, or no longer
  bool next_field = false;                  // published by bodies; behind the last one comes tissue
  std::optional<std::string> field = {};    // this one; empty: tissue
  // Orders of somebody who leads the session; a viewpoint leaves them to the program.
  bool pauses = false;                   // the session, or lets it go on
  bool goes_back = false;                // by kBackInTime_s
  std::optional<double> goes_to_s = {};  // this simulated time

  void add(const WindowInput& later);
};

// The parts of a view that can be on or off, as a program begins with them.
struct ViewOptions {
  bool wireframe = false, stereo = false;
  bool section = false;  // through what the first view looks at
  bool panel = true;
  std::string field = {};
};

class Viewpoint {
 public:
  explicit Viewpoint(ViewOptions options = {}) : options_(std::move(options)) {}

  void apply(const WindowInput& input);
  // Gives the frame this camera; the first frame gives its own.
  void look(Frame& frame);

  const ViewOptions& options() const { return options_; }
  bool halted() const { return halted_; }
  const std::optional<SectionPlane>& section() const { return section_; }
  double section_depth_m() const { return section_depth_m_; }  // behind where it was first
  double distance_m() const;                                   // from the eye to what it looks at
  std::optional<std::size_t> followed() const { return followed_; }
  // The names of all fields that bodies publish, in ascending order.
  const std::vector<std::string>& fields() const { return fields_; }

 private:
  void choose_field(const WindowInput& input);

  ViewOptions options_;
  std::optional<OrbitCamera> first_, camera_;
  std::optional<std::size_t> followed_;  // an instrument, with which the camera moves
  std::optional<Vec3> followed_world_m_;
  bool halted_ = false;
  std::optional<SectionPlane> section_;
  double section_depth_m_ = 0;
  std::vector<std::string> fields_;
};

}  // namespace sectio

// The command line of render_client.
#pragma once

#include <optional>
#include <string>

#include "common/dds/network_arguments.h"
#include "common/math/types.h"
#include "render_client/draw/camera.h"

namespace sectio {

struct ViewerOptions {
  NetworkOptions network;
  std::string name = "viewer";
  std::string directory, video_file, sheet_file, report_file, record_file;
  std::string size = "1280x720", eye, target, field, canvas = "osmesa";
  double frames_per_s = 25;
  double field_of_view_deg = 0;
  double duration_s = 0;
  int samples = 1, display = 0;
  bool wireframe = false, section = false, no_overlay = false, fit_camera = false, no_pictures = false, stereo = false,
       window = false, full_screen = false, no_panel = false, lead = false;
  Stereo eyes;
  int width_px = 0, height_px = 0;
  std::optional<Vec3> eye_world_m, target_world_m;
};

// False when there is nothing to do, because help was asked for. Throws InputError that names a flag.
bool parse(int argc, char** argv, ViewerOptions& options);

}  // namespace sectio

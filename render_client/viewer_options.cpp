#include "render_client/viewer_options.h"

#include <tuple>
#include <utility>

#include "common/core/arguments.h"
#include "common/core/error.h"

namespace sectio {

namespace {

std::optional<Vec3> parse_point(const std::string& flag, const std::string& text) {
  if (text.empty()) return std::nullopt;
  Vec3 p;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%lf,%lf,%lf%c", &p.x(), &p.y(), &p.z(), &rest) != 3 || !p.allFinite())
    throw InputError(flag + ": expected x,y,z in metres, got " + text);
  return p;
}

void check(ViewerOptions& o) {
  char rest = 0;
  if (std::sscanf(o.size.c_str(), "%5dx%5d%c", &o.width_px, &o.height_px, &rest) != 2 || o.width_px < 16 ||
      o.height_px < 16 || o.width_px > 8192 || o.height_px > 8192)
    throw InputError("--size: expected WIDTHxHEIGHT in pixels, 16 to 8192 each, got " + o.size);
  if (!o.video_file.empty() && (o.width_px % 2 != 0 || o.height_px % 2 != 0))
    throw InputError("--size: a video needs even numbers, got " + o.size);
  if (o.stereo && (o.width_px % 2 != 0 || o.width_px < 32))
    throw InputError("--size: a stereo pair needs an even width of 32 or more, got " + o.size);
  if (!(o.eyes.eye_separation_m >= 0 && o.eyes.eye_separation_m < 1))
    throw InputError("--eye-separation-m: expected 0 to 1, got " + std::to_string(o.eyes.eye_separation_m));
  if (!(o.eyes.convergence_m >= 0 && o.eyes.convergence_m < 100))
    throw InputError("--convergence-m: expected 0 to 100, got " + std::to_string(o.eyes.convergence_m));
  if (!(o.frames_per_s >= 0.1 && o.frames_per_s <= 240))
    throw InputError("--fps: expected 0.1 to 240, got " + std::to_string(o.frames_per_s));
  if (o.field_of_view_deg != 0 && !(o.field_of_view_deg >= 1 && o.field_of_view_deg <= 170))
    throw InputError("--fov: expected 1 to 170 degrees, got " + std::to_string(o.field_of_view_deg));
  if (o.duration_s < 0) throw InputError("--duration-s: expected >= 0, got " + std::to_string(o.duration_s));
  if (o.window && o.no_pictures) throw InputError("--no-pictures: --window would have nothing to show");
  for (const auto& [given, flag] : {std::pair{o.full_screen, "--full-screen"},
                                    {o.display != 0, "--display"},
                                    {o.no_panel, "--no-panel"},
                                    {o.lead, "--lead"},
                                    {o.canvas == "window", "--canvas window"}})
    if (given && !o.window) throw InputError(std::string(flag) + ": only with --window");
  if (o.canvas == "window" && !(o.video_file.empty() && o.sheet_file.empty()))
    throw InputError(
        "--canvas window: its pictures are as large as the window, and --video and --contact-sheet need "
        "all of one size");
  if (o.no_pictures && !(o.directory.empty() && o.video_file.empty() && o.sheet_file.empty()))
    throw InputError("--no-pictures: --out, --video and --contact-sheet would have nothing to write");
  for (const auto& [file, ending, flag] :
       {std::tuple{o.video_file, ".mp4", "--video"}, {o.sheet_file, ".png", "--contact-sheet"}})
    if (!file.empty() && !file.ends_with(ending))
      throw InputError(std::string(flag) + ": expected a name that ends with " + ending + ", got " + file);
  o.eye_world_m = parse_point("--camera-eye", o.eye);
  o.target_world_m = parse_point("--camera-target", o.target);
  if (o.eye_world_m && o.target_world_m && (*o.eye_world_m - *o.target_world_m).norm() < 1e-6)
    throw InputError("--camera-eye: it is at --camera-target, and looks nowhere");
  check_network_options(o.network);
}

}  // namespace

bool parse(int argc, char** argv, ViewerOptions& o) {
  Arguments arguments(
      "render_client",
      "Shows a session: holds a replica of its bodies and draws them. The last lines compare them with the server's.");
  add_network_arguments(arguments, o.network, "session to show; empty: the only one of the domain");
  arguments.option("--name", o.name, "name of this viewer in its last lines and in the report");
  arguments.toggle("--window", o.window, "a window on this desktop, whose view the mouse turns");
  arguments.toggle("--full-screen", o.full_screen, "the window covers its display");
  arguments.toggle("--no-panel", o.no_panel, "the window begins without its panel; H shows it");
  arguments.toggle("--lead", o.lead,
                   "the person at the window leads the session: pauses it and goes to an earlier time");
  arguments.option("--display", o.display, "display on which the window opens, from 0");
  arguments.option("--out", o.directory, "directory for the pictures (PNG); empty: none are written");
  arguments.option("--video", o.video_file, "file for a video (MP4)");
  arguments.option("--contact-sheet", o.sheet_file, "file for eight pictures of the session, side by side (PNG)");
  arguments.option("--record", o.record_file, "file for all that is heard (MCAP), which `sim_server play` shows");
  arguments.option("--report", o.report_file, "file for the numbers of this viewer (JSON)");
  arguments.option("--fps", o.frames_per_s, "pictures per second");
  arguments.option("--size", o.size, "width x height in pixels");
  arguments.choice("--canvas", o.canvas, {"osmesa", "egl", "window"},
                   "what draws: software; or, by a graphics card if it can, EGL without a display, or the window's own "
                   "OpenGL");
  arguments.option("--samples", o.samples, "samples per pixel: 1 (live) or 4 (smooth edges)");
  arguments.option("--camera-eye", o.eye, "x,y,z in metres; empty: as the scene says");
  arguments.option("--camera-target", o.target, "x,y,z in metres; empty: as the scene says");
  arguments.option("--fov", o.field_of_view_deg, "vertical field of view in degrees; 0: as the scene says");
  arguments.toggle("--stereo", o.stereo, "one picture for each eye, side by side, half of --size each");
  arguments.option("--eye-separation-m", o.eyes.eye_separation_m,
                   "distance between the eyes; 0: a thirtieth of the convergence distance");
  arguments.option("--convergence-m", o.eyes.convergence_m, "distance without disparity; 0: to the camera's target");
  arguments.toggle("--fit-camera", o.fit_camera, "move the camera so that all bodies are in the picture");
  arguments.option("--show-field", o.field, "scalar field of the vertices to show in colours, such as temperature");
  arguments.toggle("--wireframe", o.wireframe, "draw the edges of triangles; not in a section");
  arguments.toggle("--section", o.section, "leave out the tissue in front of the first view's target");
  arguments.toggle("--no-overlay", o.no_overlay, "leave the numbers out of the picture");
  arguments.toggle("--no-pictures", o.no_pictures, "follow the session without drawing");
  arguments.option("--duration-s", o.duration_s, "time to run in seconds; 0: until the session ends");
  if (!arguments.parse(argc, argv)) return false;
  check(o);
  return true;
}

}  // namespace sectio

#include "render_client/screen.h"

#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/core/log.h"

namespace sectio {

namespace {

constexpr std::size_t kSheetShots = 8;
constexpr int kSheetColumns = 4;
constexpr int kSheetTile_px = 480;
constexpr double kMostSectionDepth = 0.5;  // times the distance to what the eye looks at

void keep(const Image& image, double sim_time_s) {
  const std::string path = formatted("sectio_%.3f_s.png", sim_time_s);
  if (try_to_write([&] { write_png(path, image); })) log_info("kept " + path);
}

}  // namespace

bool try_to_write(const std::function<void()>& write) {
  try {
    write();
    return true;
  } catch (const InputError& error) {
    log_error(error.what());
    return false;
  }
}

Screen::Screen(const ViewerOptions& options)
    : options_(options),
      viewpoint_({.wireframe = options.wireframe,
                  .stereo = options.stereo,
                  .section = options.section,
                  .panel = !options.no_panel,
                  .field = options.field}),
      shots_(kSheetShots, kSheetTile_px) {
  if (!options.directory.empty()) pngs_ = std::make_unique<PngSequence>(options.directory);
  if (!options.video_file.empty())
    video_ =
        std::make_unique<VideoWriter>(options.video_file, options.width_px, options.height_px, options.frames_per_s);
  if (options.no_pictures) return;
  const bool in_window = options.canvas == "window";
  if (options.window && in_window) open_window();
  if (!in_window) {
    const auto make_canvas = options.canvas == "egl" ? make_egl_canvas : make_osmesa_canvas;
    canvas_ = make_canvas(options.width_px, options.height_px, options.samples);
  }
  painter_ = std::make_unique<FramePainter>(in_window ? *window_->canvas() : *canvas_);
  if (options.window && !in_window) open_window();
}

bool Screen::listen() {
  if (!window_) return true;
  heard_ = window_->input();
  viewpoint_.apply(heard_);
  keeps_picture_ = keeps_picture_ || heard_.keeps_picture;
  return !heard_.closes;
}

bool Screen::wants_pixels() const {
  return keeps_picture_ || pngs_ || video_ || !options_.sheet_file.empty();
}

DrawOptions Screen::draw_options(double frames_per_s) const {
  const ViewOptions& view = viewpoint_.options();
  DrawOptions draw{.wireframe = view.wireframe,
                   .overlay = !options_.no_overlay && !window_,  // a window has its panel
                   .fit_camera = options_.fit_camera,
                   .frames_per_s = frames_per_s,
                   .section = window_ ? viewpoint_.section() : section_,
                   .field = view.field};
  if (view.stereo) draw.stereo = options_.eyes;
  return draw;
}

void Screen::show(Frame& frame, int missed, double frames_per_s) {
  if (!painter_) return;
  if (options_.eye_world_m) frame.camera.eye_world_m = *options_.eye_world_m;
  if (options_.target_world_m) frame.camera.target_world_m = *options_.target_world_m;
  if (options_.field_of_view_deg != 0) frame.camera.field_of_view_deg = options_.field_of_view_deg;
  if (window_) {
    viewpoint_.look(frame);
    window_->want_pixels(wants_pixels());
  } else if (options_.section && !section_) {
    section_ = section_at_target(frame.camera);
  }
  const Image& image = painter_->draw_frame(frame, draw_options(frames_per_s));
  if (!options_.field.empty() && !painter_->field_range() && !std::exchange(has_missed_field_, true))
    log_warning("--show-field: no body has a field " + options_.field + " yet: it is shown from when one has it");
  if (window_) show_in_window(image);
  write(image, frame.sim_time_s, missed);
}

void Screen::show_in_window(const Image& image) {
  const ViewOptions& view = viewpoint_.options();
  panel_.halted = viewpoint_.halted();
  panel_.wireframe = view.wireframe;
  panel_.stereo = view.stereo;
  panel_.followed = viewpoint_.followed();
  panel_.section_depth_m.reset();
  if (viewpoint_.section()) panel_.section_depth_m = viewpoint_.section_depth_m();
  panel_.most_section_depth_m = kMostSectionDepth * viewpoint_.distance_m();
  panel_.fields = viewpoint_.fields();
  panel_.field = view.field;
  panel_.field_range = painter_->field_range();
  window_->show(image, view.panel ? &panel_ : nullptr);
}

void Screen::write(const Image& image, double sim_time_s, int missed) {
  if (std::exchange(keeps_picture_, false)) keep(image, sim_time_s);
  if (pngs_ && !try_to_write([&] { pngs_->write(image); })) pngs_.reset();
  if (!options_.sheet_file.empty()) shots_.offer(image, sim_time_s);
  for (int i = 0; video_ && i <= missed; ++i)
    if (!video_->write(image)) {
      log_error(options_.video_file + ": the video encoder has died; the video ends here");
      video_.reset();
      is_whole_ = false;
    }
}

bool Screen::finish() {
  if (video_ && !video_->finish()) {
    log_error(options_.video_file + ": the video is incomplete");
    is_whole_ = false;
  }
  const std::vector<Shot> shots = shots_.shots();
  if (!shots.empty())
    try_to_write([&] { write_png(options_.sheet_file, contact_sheet(shots, kSheetColumns, kSheetTile_px)); });
  return is_whole_;
}

bool Screen::try_to_write(const std::function<void()>& write) {
  const bool done = sectio::try_to_write(write);
  is_whole_ = is_whole_ && done;
  return done;
}

void Screen::open_window() {
  window_ = std::make_unique<Window>(WindowOptions{.title = "Sectio: " + options_.name,
                                                   .width_px = options_.width_px,
                                                   .height_px = options_.height_px,
                                                   .display = options_.display,
                                                   .full_screen = options_.full_screen,
                                                   .opengl = options_.canvas == "window",
                                                   .samples_per_pixel = options_.samples});
  log_info(Window::help());
}

}  // namespace sectio

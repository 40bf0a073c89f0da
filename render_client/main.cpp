// The viewer: replica, pictures, files. It draws at its own steady rate, independent of the server's.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <thread>
#include <utility>

#include "common/core/arguments.h"
#include "common/core/error.h"
#include "common/core/log.h"
#include "common/core/report_figures.h"
#include "common/core/stop_signal.h"
#include "common/core/wall_time.h"
#include "common/core/write_file.h"
#include "common/dds/find_session.h"
#include "common/dds/network_arguments.h"
#include "render_client/draw/canvas.h"
#include "render_client/draw/draw_frame.h"
#include "render_client/net/client_net.h"
#include "render_client/output/contact_sheet.h"
#include "render_client/output/png.h"
#include "render_client/output/video.h"
#include "render_client/view_record.h"
#include "render_client/window/window.h"

namespace sectio {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr double kEndPatience_s = 5;       // for the final topology, after the server has announced it ...
constexpr double kMostEndPatience_s = 60;  // ... and longer while it comes over a thin link
constexpr double kFinalPicture_s = 0.5;    // how long the last state is shown
constexpr std::size_t kSheetShots = 8;
constexpr int kSheetColumns = 4;
constexpr int kSheetTile_px = 480;
constexpr double kForEver_s = 1e9;
constexpr double kMaxRepeat_s = 1;  // a video's picture may stand in so long for those that came too late

struct Options {
  NetworkOptions network;
  std::string name = "viewer";
  std::string directory, video_file, sheet_file, report_file, record_file;
  std::string size = "1280x720", eye, target, field, canvas = "osmesa";
  double frames_per_s = 25;
  double field_of_view_deg = 0;
  double duration_s = 0;
  int samples = 1, display = 0;
  bool wireframe = false, section = false, no_overlay = false, fit_camera = false, no_pictures = false, stereo = false,
       window = false, full_screen = false;
  Stereo eyes;
  int width_px = 0, height_px = 0;
  std::optional<Vec3> eye_world_m, target_world_m;
};

std::optional<Vec3> parse_point(const std::string& flag, const std::string& text) {
  if (text.empty()) return std::nullopt;
  Vec3 p;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%lf,%lf,%lf%c", &p.x(), &p.y(), &p.z(), &rest) != 3 || !p.allFinite())
    throw InputError(flag + ": expected x,y,z in metres, got " + text);
  return p;
}

void check(Options& o) {
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
  if (!o.window && (o.full_screen || o.display != 0))
    throw InputError(std::string(o.full_screen ? "--full-screen" : "--display") + ": only with --window");
  if (o.no_pictures && !(o.directory.empty() && o.video_file.empty() && o.sheet_file.empty()))
    throw InputError("--no-pictures: --out, --video and --contact-sheet would have nothing to write");
  o.eye_world_m = parse_point("--camera-eye", o.eye);
  o.target_world_m = parse_point("--camera-target", o.target);
  check_network_options(o.network);
}

bool parse(int argc, char** argv, Options& o) {
  Arguments arguments(
      "render_client",
      "Shows a session: holds a replica of its bodies and draws them. The last lines compare them with the server's.");
  add_network_arguments(arguments, o.network, "session to show; empty: the only one of the domain");
  arguments.option("--name", o.name, "name of this viewer in its last lines and in the report");
  arguments.toggle("--window", o.window, "a window on this desktop, whose view the mouse turns");
  arguments.toggle("--full-screen", o.full_screen, "the window covers its display");
  arguments.option("--display", o.display, "display on which the window opens, from 0");
  arguments.option("--out", o.directory, "directory for the pictures (PNG); empty: none are written");
  arguments.option("--video", o.video_file, "file for a video (MP4)");
  arguments.option("--contact-sheet", o.sheet_file, "file for eight pictures of the session, side by side (PNG)");
  arguments.option("--record", o.record_file, "file for all that is heard (MCAP), which `sim_server play` shows");
  arguments.option("--report", o.report_file, "file for the numbers of this viewer (JSON)");
  arguments.option("--fps", o.frames_per_s, "pictures per second");
  arguments.option("--size", o.size, "width x height in pixels");
  arguments.choice("--canvas", o.canvas, {"osmesa", "egl"},
                   "what draws: software, or EGL without a display, by a graphics card if it can");
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
  arguments.toggle("--wireframe", o.wireframe, "draw the edges of triangles");
  arguments.toggle("--section", o.section, "leave out the tissue in front of the first view's target");
  arguments.toggle("--no-overlay", o.no_overlay, "leave the numbers out of the picture");
  arguments.toggle("--no-pictures", o.no_pictures, "follow the session without drawing");
  arguments.option("--duration-s", o.duration_s, "time to run in seconds; 0: until the session ends");
  if (!arguments.parse(argc, argv)) return false;
  check(o);
  return true;
}

// A disk that is full costs a viewer its files, and not the session.
bool try_to_write(const auto& write) {
  try {
    write();
    return true;
  } catch (const InputError& error) {
    log_error(error.what());
    return false;
  }
}

// Draws frames and writes the pictures to files; with --no-pictures it does nothing.
class Screen {
 public:
  explicit Screen(const Options& options) : options_(options) {
    if (!options.directory.empty()) pngs_ = std::make_unique<PngSequence>(options.directory);
    if (!options.video_file.empty())
      video_ =
          std::make_unique<VideoWriter>(options.video_file, options.width_px, options.height_px, options.frames_per_s);
    if (options.no_pictures) return;
    const auto make_canvas = options.canvas == "egl" ? make_egl_canvas : make_osmesa_canvas;
    canvas_ = make_canvas(options.width_px / (options.stereo ? 2 : 1), options.height_px, options.samples);
    painter_ = std::make_unique<FramePainter>(*canvas_);
    if (!options.window) return;
    window_ = std::make_unique<Window>(WindowOptions{"Sectio: " + options.name, options.width_px, options.height_px,
                                                     options.display, options.full_screen});
    log_info(Window::help());
  }

  // The person at the window, if there is one. False: they have closed it.
  bool listen() {
    if (!window_) return true;
    const WindowInput input = window_->input();
    viewpoint_.apply(input);
    keeps_picture_ = keeps_picture_ || input.keeps_picture;
    return !input.closes;
  }
  bool halted() const { return viewpoint_.halted(); }

  // `missed`: the number of pictures before this one that came too late; a video shows this one in their place.
  void show(Frame& frame, int missed, double frames_per_s) {
    if (!painter_) return;
    if (options_.eye_world_m) frame.camera.eye_world_m = *options_.eye_world_m;
    if (options_.target_world_m) frame.camera.target_world_m = *options_.target_world_m;
    if (options_.field_of_view_deg != 0) frame.camera.field_of_view_deg = options_.field_of_view_deg;
    if (window_) viewpoint_.look(frame);
    DrawOptions draw{.wireframe = options_.wireframe != viewpoint_.wireframe(),
                     .overlay = !options_.no_overlay,
                     .fit_camera = options_.fit_camera,
                     .frames_per_s = frames_per_s,
                     .field = options_.field};
    if (options_.stereo) draw.stereo = options_.eyes;
    if (options_.section && !section_) section_ = section_at_target(frame.camera);
    draw.section = window_ && viewpoint_.section() ? viewpoint_.section() : section_;
    const Image& image = painter_->draw_frame(frame, draw);
    if (window_) window_->show(image);
    if (std::exchange(keeps_picture_, false)) keep(image, frame.sim_time_s);
    if (pngs_ && !try_to_write([&] { pngs_->write(image); })) pngs_.reset();
    if (!options_.sheet_file.empty()) shots_.offer(image, frame.sim_time_s);
    for (int i = 0; video_ && i <= missed; ++i)
      if (!video_->write(image)) {
        log_error(options_.video_file + ": the video encoder has died; the video ends here");
        video_.reset();
        is_whole_ = false;
      }
  }

  // False when something that was asked for is not there.
  bool finish() {
    if (video_ && !video_->finish()) {
      log_error(options_.video_file + ": the video is incomplete");
      is_whole_ = false;
    }
    const std::vector<Shot> shots = shots_.shots();
    if (!shots.empty())
      try_to_write([&] { write_png(options_.sheet_file, contact_sheet(shots, kSheetColumns, kSheetTile_px)); });
    return is_whole_;
  }

 private:
  bool try_to_write(const auto& write) {
    const bool done = sectio::try_to_write(write);
    is_whole_ = is_whole_ && done;
    return done;
  }
  static void keep(const Image& image, double sim_time_s) {
    char path[64];
    std::snprintf(path, sizeof path, "sectio_%.3f_s.png", sim_time_s);
    if (sectio::try_to_write([&] { write_png(path, image); })) log_info(std::string("kept ") + path);
  }

  const Options& options_;
  std::unique_ptr<Window> window_;
  Viewpoint viewpoint_;
  bool keeps_picture_ = false, is_whole_ = true;
  std::optional<SectionPlane> section_;
  std::unique_ptr<Canvas> canvas_;
  std::unique_ptr<FramePainter> painter_;
  std::unique_ptr<PngSequence> pngs_;
  std::unique_ptr<VideoWriter> video_;
  EvenShots shots_{kSheetShots, kSheetTile_px};
};

// Tells when to stop: the final state of the session has been shown, or the time is over.
class Ending {
 public:
  Ending(double duration_s, double begun_s) : stop_s_(duration_s > 0 ? begun_s + duration_s : 1e300) {}

  bool due(double time_s, const World& world) {
    if (stop_was_requested() || time_s >= stop_s_) return true;
    const std::optional<SessionEnd> end = world.session_end();
    if (!end) return false;
    if (!heard_) last_s_ = std::min(stop_s_, time_s + kMostEndPatience_s);
    heard_ = true;
    if (const std::uint64_t come = come_of(world); come != come_ && !reached_) {
      come_ = come;
      stop_s_ = std::min(last_s_, time_s + kEndPatience_s);
    }
    if (!reached_ && has_reached(*end, world)) {
      stop_s_ = std::min(stop_s_, time_s + kFinalPicture_s);
      reached_ = true;
    }
    return false;
  }

 private:
  // Changes with everything that leads to the final topology.
  static std::uint64_t come_of(const World& world) {
    std::uint64_t come = world.pulled_bytes() + 1;
    for (const ReplicaBody* body : world.bodies()) come += body->mesh().revision();
    return come;
  }
  static bool has_reached(const SessionEnd& end, const World& world) {
    const std::vector<const ReplicaBody*> bodies = world.bodies();
    for (std::size_t b = 0; b < bodies.size(); ++b)
      if (bodies[b]->mesh().revision() != end.bodies.at(b).revision) return false;
    return true;
  }

  double stop_s_, last_s_ = 0;
  std::uint64_t come_ = 0;
  bool heard_ = false;
  bool reached_ = false;
};

int view(Options options) {
  catch_stop_signals();
  if (!options.report_file.empty()) check_can_write(options.report_file);  // now, not at the end
  std::optional<HeardRecord> heard;
  if (!options.record_file.empty()) heard.emplace(options.record_file, options.name);
  Screen screen(options);
  const double patience_s = options.duration_s > 0 ? options.duration_s : kForEver_s;
  if (!find_session(options.network, patience_s, stop_was_requested)) return 1;
  ClientNet net(options.network, options.name.substr(0, kMaxNameBytes));
  if (heard) net.record(*heard);
  World world;
  Frame frame, halted;
  bool was_halted = false;
  ViewRecord record;
  Ending ending(options.duration_s, steady_now_s());
  bool connected = false, any = false;
  const std::string session =
      "session '" + options.network.session + "' on domain " + std::to_string(options.network.domain);
  log_info("waiting for " + session);

  const double interval_s = 1 / options.frames_per_s;
  double due_s = steady_now_s();
  while (!ending.due(steady_now_s(), world)) {
    const double sync_begun_s = steady_now_s();
    net.poll(sync_begun_s, world);
    if (const bool now = net.connected(); now != connected) {
      connected = now;
      log_info(connected ? "connected to a server" : "the server has gone; waiting for it, or for another");
    }
    const bool is_new = world.frame(steady_now_s(), frame);
    if (heard) heard->keep(world);
    record.add_sync(steady_now_s() - sync_begun_s, world);
    if (is_new && !any) log_info("session '" + frame.session + "' on the screen");
    any = any || is_new;
    const double begun_s = steady_now_s();
    const int missed = static_cast<int>(std::clamp((begun_s - due_s) / interval_s, 0.0, kMaxRepeat_s / interval_s));
    if (!screen.listen()) break;
    if (any) {
      if (screen.halted() && !was_halted) halted = frame;
      was_halted = screen.halted();
      screen.show(was_halted ? halted : frame, missed, record.pictures_per_s());
      record.add(steady_now_s(), steady_now_s() - begun_s, frame, is_new);
    }
    due_s += (1 + missed) * interval_s;
    if (due_s < steady_now_s() - kMaxRepeat_s) due_s = steady_now_s();
    std::this_thread::sleep_until(Clock::time_point(std::chrono::duration_cast<Clock::duration>(Seconds(due_s))));
  }
  bool whole = screen.finish();

  const std::vector<BodyVersion> versions = world.catch_up();
  if (heard) heard->keep(world);
  if (heard && !heard->finish()) whole = false;
  const std::vector<std::string> names = world.body_names();
  const std::optional<SessionEnd> end = world.session_end();
  const std::string report = record.json(options.name, world, net.counts(), versions, end);
  if (!options.report_file.empty() && !try_to_write([&] { write_file(options.report_file, report); })) whole = false;
  bool differs = false;
  for (std::size_t b = 0; b < versions.size(); ++b) {
    const std::string equal = equals_server(b, versions, end);
    differs = differs || equal == "no";
    std::printf("client %s: body %s revision %llu hash %s equals server: %s\n", options.name.c_str(), names[b].c_str(),
                static_cast<unsigned long long>(versions[b].revision), hash_text(versions[b].topology_hash).c_str(),
                equal.c_str());
  }
  if (versions.empty()) log_error("no server of " + session + " was met");
  return differs || versions.empty() || !whole ? 1 : 0;
}

}  // namespace
}  // namespace sectio

int main(int argc, char** argv) {
  return sectio::run_program("render_client", [&] {
    sectio::Options options;
    return sectio::parse(argc, argv, options) ? sectio::view(options) : 0;
  });
}

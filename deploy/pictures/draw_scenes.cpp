// Draws moments of scenes side by side, for the pictures of the documents. Simulates the scenes in this process; on one
// machine the same call makes the same picture every time.
#include <algorithm>
#include <charconv>
#include <cstdio>
#include <functional>
#include <map>
#include <set>
#include <span>
#include <vector>

#include "common/core/arguments.h"
#include "common/core/error.h"
#include "common/core/joined.h"
#include "deploy/pictures/scene_frame.h"
#include "render_client/draw/canvas.h"
#include "render_client/output/png.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/session/trace_player.h"

namespace sectio {
namespace {

constexpr int kGap_px = 4;

struct Options {
  std::string out, size = "600x500", field;
  std::vector<std::string> moments;
  int samples = 4, columns = 0;
  double close_up_m = 0;
  bool wireframe = false, section = false, stereo = false;
  int width_px = 0, height_px = 0;
};

struct Moment {
  std::string scene_file;
  double time_s = 0;
  int place = 0;  // in the picture
};

Moment parse_moment(const std::string& text) {
  const std::size_t at = text.rfind('@');
  Moment moment;
  const char* const end = text.data() + text.size();
  if (at == std::string::npos || text.ends_with('@') ||
      std::from_chars(text.data() + at + 1, end, moment.time_s).ptr != end || !(moment.time_s >= 0))
    throw InputError("--scene: expected SCENE.yaml@SECONDS, got " + text);
  moment.scene_file = text.substr(0, at);
  return moment;
}

Frame whole_frame_of(const Scene& scene, Simulation& simulation) {
  Frame frame = frame_of(scene, simulation);
  frame.floor_z_m = scene.floor_z_m;
  for (std::uint32_t t = 0; t < scene.tools.size(); ++t) {
    const ToolGeometry& g = scene.tools[t].geometry;
    const std::optional<JointPose>& pose = simulation.tool_pose_world(t);
    frame.tools.push_back({scene.tools[t].name,
                           scene.tools[t].kind,
                           pose.has_value(),
                           pose.value_or(JointPose{}),
                           {g.a_tool_m, g.b_tool_m, g.c_tool_m, g.d_tool_m},
                           g.gauge_m});
  }
  return frame;
}

// The same view from near: the middle of the walls that cuts have made is in the middle of the picture.
void come_near(Frame& frame, double distance_m) {
  Box3 walls;
  for (const BodyFrame& body : frame.bodies)
    for (const Triangle& t : body.triangles)
      if (t.alive() && t.surface == Surface::wall)
        for (const VertexId v : t.v) walls.extend(body.positions_world_m[v].cast<double>());
  if (walls.isEmpty()) return;
  Camera& camera = frame.camera;
  const Vec3 back = (camera.eye_world_m - camera.target_world_m).normalized();
  camera.target_world_m = walls.center();
  camera.eye_world_m = walls.center() + distance_m * back;
}

// A field that nothing has would be drawn as if none had been asked for.
void check_field(const Frame& frame, const std::string& field, const std::string& scene_file) {
  if (field.empty()) return;
  std::set<std::string> names;
  for (const BodyFrame& body : frame.bodies)
    for (const ScalarField& scalars : body.scalars) names.insert(scalars.name);
  if (names.contains(field)) return;
  throw InputError("--show-field: no body of " + scene_file + " has a field " + field + "; there are " +
                   (names.empty() ? "none" : joined(names)));
}

// Simulates a scene once and draws its moments, which ascend in time.
void draw(std::span<const Moment> moments, const Options& options, const std::function<void(int, const Image&)>& done) {
  const Scene scene = prepared(load_scene(moments.front().scene_file, standard_traits()));
  Simulation simulation(scene);
  StepInput input;
  std::uint64_t k = 1;
  for (const Moment& moment : moments) {
    for (; static_cast<double>(k) * scene.step_s <= moment.time_s + 1e-9; ++k) {
      input.samples = samples_of_traces(scene, k);
      simulation.step(input);
    }
    const auto canvas =
        make_osmesa_canvas(options.width_px * (options.stereo ? 2 : 1), options.height_px, options.samples);
    DrawOptions draw{.wireframe = options.wireframe, .overlay = !options.field.empty(), .field = options.field};
    if (options.stereo) draw.stereo = Stereo{};
    Frame frame = whole_frame_of(scene, simulation);
    check_field(frame, options.field, scene.file);
    if (options.section) draw.section = section_at_target(frame.camera);
    if (options.close_up_m > 0) come_near(frame, options.close_up_m);
    done(moment.place, FramePainter(*canvas).draw_frame(frame, draw));
  }
}

int run(int argc, char** argv) {
  Options options;
  Arguments arguments("draw_scenes", "Simulates scenes and draws moments of them side by side.");
  arguments.option("OUT", options.out, "picture (PNG)", Need::required);
  arguments.option("--scene", options.moments, "SCENE.yaml@SECONDS: a moment to draw; may be repeated", Need::required);
  arguments.option("--size", options.size, "of each picture, WIDTHxHEIGHT in pixels");
  arguments.option("--columns", options.columns, "pictures in a row; 0: all of them");
  arguments.option("--samples", options.samples, "samples per pixel: 1 or 4");
  arguments.toggle("--stereo", options.stereo, "one picture for each eye, side by side, each of --size");
  arguments.option("--show-field", options.field, "scalar field of the vertices to show in colours, with its legend");
  arguments.option("--close-up", options.close_up_m,
                   "distance in m from which to look at the cuts; 0: the scene's view");
  arguments.toggle("--wireframe", options.wireframe, "draw the edges of triangles");
  arguments.toggle("--section", options.section, "leave out the tissue in front of the view's target");
  if (!arguments.parse(argc, argv)) return 0;
  char rest = 0;
  if (std::sscanf(options.size.c_str(), "%5dx%5d%c", &options.width_px, &options.height_px, &rest) != 2 ||
      std::min(options.width_px, options.height_px) < 16 || std::max(options.width_px, options.height_px) > 8192)
    throw InputError("--size: expected WIDTHxHEIGHT in pixels, 16 to 8192 each, got " + options.size);
  if (options.samples != 1 && options.samples != 4)
    throw InputError("--samples: expected 1 or 4, got " + std::to_string(options.samples));
  if (options.close_up_m < 0) throw InputError("--close-up: expected >= 0, got " + std::to_string(options.close_up_m));
  if (options.columns < 0) throw InputError("--columns: expected 0 or more, got " + std::to_string(options.columns));

  const int n = static_cast<int>(options.moments.size());
  const int columns = options.columns == 0 ? n : std::min(n, options.columns), rows = (n + columns - 1) / columns;
  const int across_px = options.width_px * (options.stereo ? 2 : 1) + kGap_px, down_px = options.height_px + kGap_px;
  Image picture(columns * across_px - kGap_px, rows * down_px - kGap_px, {255, 255, 255, 255});
  std::map<std::string, std::vector<Moment>> by_scene;
  for (int i = 0; i < n; ++i) {
    Moment moment = parse_moment(options.moments[static_cast<std::size_t>(i)]);
    moment.place = i;
    by_scene[moment.scene_file].push_back(moment);
  }
  for (auto& [file, moments] : by_scene) {
    std::ranges::stable_sort(moments, {}, &Moment::time_s);
    draw(moments, options, [&](int place, const Image& image) {
      paste(picture, image, place % columns * across_px, place / columns * down_px);
    });
  }
  write_png(options.out, picture);
  return 0;
}

}  // namespace
}  // namespace sectio

int main(int argc, char** argv) {
  return sectio::run_program("draw_scenes", [&] { return sectio::run(argc, argv); });
}

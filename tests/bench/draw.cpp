// The cost of a picture of 10 000 triangles at 1280 x 720 on one thread of llvmpipe: skin in the shader variant that it
// needs, against one that can do everything; and a whole frame. Ratios within one run, of the processor's time.
#include <array>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>

#include "render_client/draw/body_mesh.h"
#include "render_client/draw/draw_frame.h"
#include "tests/bench/bench.h"
#include "tests/unit/draw/test_organ.h"

namespace sectio::draw_bench {
namespace {

constexpr int kWidth = 1280, kHeight = 720;
constexpr test::OrganShape kOrgan{.rings = 51, .around = 100, .opening_m = 0};  // 10 000 triangles

Canvas& shared_canvas() {
  static const std::unique_ptr<Canvas> canvas = make_osmesa_canvas(kWidth, kHeight);
  return *canvas;
}

// From so near that the organ fills half of the picture.
Camera near_camera() {
  Camera camera = test::make_frame().camera;
  camera.eye_world_m = camera.target_world_m + 0.9 * (camera.eye_world_m - camera.target_world_m);
  return camera;
}

Region blue_ball(const Vec3& centre_m) {
  Region region;
  region.colour = Vec3(0.1, 0.2, 0.8);
  region.parts = {{RegionForm::ellipsoid, centre_m, Vec3::Constant(0.03)}};
  return region;
}

struct Wanted {
  const char* name;
  bool region_in_sight = false, region_out_of_sight = false, occluder = false, pattern_per_pixel = false;
};

void draw_skin(benchmark::State& state, const Wanted& wanted) {
  Canvas& canvas = shared_canvas();
  const BodyFrame body = test::make_organ(kOrgan);
  BodyMesh mesh;
  mesh.arrange(body);
  if (!mesh.move(body)) return state.SkipWithError("the organ can't be drawn");
  const MeshId id = canvas.add_mesh();
  canvas.set_indices(id, mesh.indices());
  canvas.set_vertices(id, mesh.vertices());
  if (wanted.region_in_sight) canvas.set_regions(id, std::array{blue_ball(Vec3(0, 0, 0.02))}, mesh.rest_box());
  if (wanted.region_out_of_sight) canvas.set_regions(id, std::array{blue_ball(Vec3(0, 0, 1))}, mesh.rest_box());
  CanvasView view;
  view.view_from_world = view_from_world(near_camera());
  view.projection = projection(near_camera(), static_cast<double>(kWidth) / kHeight);
  view.occluder_count = wanted.occluder ? 1 : 0;  // an occluder without size
  const Material material{Shading::skin, body.skin_colour.cast<float>(), wanted.pattern_per_pixel};
  const auto draw = [&] {
    canvas.begin(view);
    canvas.draw(id, mesh.skin(), material, Eigen::Matrix4f::Identity());
    return canvas.finish().rgba.data();
  };
  draw();  // compiles the shader
  for (auto _ : state) benchmark::DoNotOptimize(draw());
  canvas.remove_mesh(id);
}

struct Scenery {
  const char* name;
  bool instrument = false, floor = false;
};

// A moving body with a cut as a viewer draws it, without the numbers over it.
void draw_frame(benchmark::State& state, const Scenery& scenery) {
  Frame frame = test::make_frame({.rings = 51, .around = 100});
  frame.camera = near_camera();
  if (scenery.floor) frame.floor_z_m = -0.05;
  if (scenery.instrument) frame.tools = {test::make_scalpel_at(Vec3(0, 0, 0.03))};
  FramePainter painter(shared_canvas());
  painter.draw_frame(frame, {.overlay = false});  // compiles the shaders
  for (auto _ : state) benchmark::DoNotOptimize(painter.draw_frame(frame, {.overlay = false}).rgba.data());
}

constexpr Wanted kPlain{"plain"};
constexpr Wanted kShadow{.name = "with a shadow", .occluder = true};
constexpr Wanted kRegion{.name = "with a region", .region_in_sight = true};
constexpr Wanted kPerPixel{.name = "pattern per pixel", .pattern_per_pixel = true};
constexpr Wanted kEverything{
    .name = "everything", .region_out_of_sight = true, .occluder = true, .pattern_per_pixel = true};

constexpr std::array kSceneries{Scenery{"frame of a body"}, Scenery{"frame with an instrument", true},
                                Scenery{"frame with instrument and floor", true, true}};

void add(const char* name, const std::function<void(benchmark::State&)>& run) {
  benchmark::RegisterBenchmark(name, run)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->MinTime(1);
}

void print(const bench::BestTimes& times) {
  const auto time_ms = [&](const std::string& name) {
    for (const auto& [key, time] : times)
      if (key.starts_with(name + "/")) return time;
    return 0.0;
  };
  const double plain_ms = time_ms(kPlain.name);
  if (plain_ms == 0) return;
  std::fprintf(stderr, "skin alone in a picture of %d x %d, plain: %.1f ms of one thread\n", kWidth, kHeight, plain_ms);
  for (const Wanted& wanted : {kShadow, kRegion, kPerPixel, kEverything})
    std::fprintf(stderr, "  %-18s %.2f times as much\n", wanted.name, time_ms(wanted.name) / plain_ms);
  for (const Scenery& scenery : kSceneries)
    if (const double frame_ms = time_ms(scenery.name); frame_ms > 0)
      std::fprintf(stderr, "%-32s %.1f ms, %.0f pictures/s\n", scenery.name, frame_ms, 1000 / frame_ms);
}

const bench::Subject subject("draw", [](int argc, char** argv) {
  setenv("LP_NUM_THREADS", "1", 1);
  for (const auto& wanted : {kPlain, kShadow, kRegion, kPerPixel, kEverything})
    add(wanted.name, [wanted](benchmark::State& state) { draw_skin(state, wanted); });
  for (const auto& scenery : kSceneries)
    add(scenery.name, [scenery](benchmark::State& state) { draw_frame(state, scenery); });
  return bench::run(argc, argv, print);
});

}  // namespace
}  // namespace sectio::draw_bench

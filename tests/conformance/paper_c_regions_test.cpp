// The inside of an organ (paper C, future work: volumetric textures): the same rest point has the same colour before
// and after a cut, on skin and on walls, and it is what the server's own function says.
#include <gtest/gtest.h>

#include "common/material/region_volumes.h"
#include "common/mesh/check.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/session/trace_player.h"
#include "tests/support/drawn_scene.h"

namespace sectio {
namespace {

constexpr int kWidth = 480, kHeight = 400;
constexpr double kBorder_m = 4e-4;  // about a pixel: nearer to a border, either side is right
enum Kind : std::uint32_t { kTumour, kVessel, kBase, kUnclear };

Region region(const char* name, const Vec3& colour) {
  Region r;
  r.name = name;
  r.colour = r.grain_colour = r.rim_colour = colour;
  return r;
}

// The bar that a knife goes through at x = 5 mm; a blue tumour in it that reaches its side, a green vessel along it.
Scene bar_with_regions(const std::string& name) {
  Scene scene = load_scene(SECTIO_SOURCE_DIR "/deploy/scenes/" + name + ".yaml", standard_traits());
  BodySpec& bar = scene.bodies[0];
  bar.skin_colour = bar.wall_colour = Vec3(0.75, 0.12, 0.12);
  bar.regions = {region("tumour", Vec3(0.12, 0.2, 0.8)), region("vessel", Vec3(0.12, 0.7, 0.12))};
  bar.regions[kTumour].marked = true;
  bar.regions[kTumour].ripple_m = 0.0008;
  bar.regions[kTumour].parts = {{RegionForm::ellipsoid, Vec3(0.006, -0.004, 0.003), Vec3(0.014, 0.008, 0.005), 0, 0,
                                 Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Vec3::UnitZ()))}};
  bar.regions[kVessel].parts = {
      {RegionForm::tube, Vec3(-0.045, 0.004, -0.004), Vec3(0.004, 0.004, -0.004), 0.002, 0.0025},
      {RegionForm::tube, Vec3(0.004, 0.004, -0.004), Vec3(0.045, 0.004, -0.002), 0.0025, 0.002}};
  return scene;
}

// Light and grain leave the hue of a colour.
Kind kind_of(const std::uint8_t* rgb) {
  const int most = std::max({rgb[0], rgb[1], rgb[2]}), least = std::min({rgb[0], rgb[1], rgb[2]});
  if (most < 25 || 10 * (most - least) < 4 * most) return kUnclear;  // dark, or a highlight
  return rgb[2] == most ? kTumour : rgb[1] == most ? kVessel : kBase;
}

struct Count {
  std::array<int, 3> skin{}, wall{};
  int right = 0, wrong = 0;
};

Count compare(const Frame& frame, const Image& image) {
  const auto seen = test::seen_points(frame, kWidth, kHeight);
  Count count;
  for (int y = 1; y + 1 < kHeight; ++y)
    for (int x = 1; x + 1 < kWidth; ++x) {
      const auto& point = seen[static_cast<std::size_t>(y * kWidth + x)];
      const Kind shown = kind_of(image.pixel(x, y));
      if (!point || shown == kUnclear) continue;
      const Regions& regions = frame.bodies[point->body].regions;
      bool near_border = false;
      for (const Region& r : regions) near_border |= std::abs(signed_distance_m(r, point->rest_m)) < kBorder_m;
      if (near_border) continue;
      const std::uint32_t region = region_at(regions, point->rest_m);
      const std::uint32_t expected = region == kNoRegion ? kBase : region;
      ++(shown == expected ? count.right : count.wrong);
      ++(point->surface == Surface::skin ? count.skin : count.wall)[expected];
    }
  return count;
}

// A run of the scene with a knife that goes through.
struct CutBar {
  CutBar(const std::string& name, std::uint64_t steps) : scene(prepared(bar_with_regions(name))), simulation(scene) {
    before = frame_of(scene, simulation);
    for (std::uint64_t k = 1; k <= steps; ++k) {
      StepInput input;
      input.samples = samples_of_traces(scene, k);
      simulation.step(input);
    }
    after = frame_of(scene, simulation);
  }
  Scene scene;
  Simulation simulation;
  Frame before, after;
};

CutBar& cut_bar() {
  static CutBar bar("bar_one_sequence", 2800);
  return bar;
}

void expect_colours_of_regions(CutBar& bar, bool shows_vessel) {
  const auto canvas = make_osmesa_canvas(kWidth, kHeight);
  for (Frame* frame : {&bar.before, &bar.after}) {
    FramePainter painter(*canvas);
    const Image image = painter.draw_frame(*frame, {.overlay = false});
    const Count count = compare(*frame, image);
    EXPECT_GT(count.right, 4000);
    EXPECT_LT(count.wrong, count.right / 200) << "outlines of the body, by a pixel";
    EXPECT_GT(count.skin[kTumour], 100) << "it reaches the side";
    EXPECT_GT(count.skin[kBase], 1000);
    EXPECT_EQ(count.skin[kVessel], 0) << "inside";
    if (frame == &bar.before) continue;
    EXPECT_GT(count.wall[kTumour], 300) << "the tumour is told from";
    EXPECT_GT(count.wall[kBase], 300) << "the tissue around it and";
    EXPECT_TRUE(count.wall[kVessel] > 50 || !shows_vessel) << "the vessel";
  }
}

TEST(C_FUT, C_FUT_6_a_rest_point_has_the_colour_of_its_region_before_and_after_a_cut) {
  ASSERT_EQ(cut_bar().simulation.body_count(), 2u) << "the free half came off";
  // From where the end that stayed shows its wall.
  cut_bar().after.camera = {Vec3(0.1, -0.05, 0.035), Vec3(0, 0, 0.05), Vec3::UnitZ(), 30};
  expect_colours_of_regions(cut_bar(), true);
}

TEST(C_FUT, C_FUT_6_so_it_has_in_a_volume_that_deforms) {
  CutBar bar("bar_volume_falls", 2800);
  bar.after.bodies.resize(1);  // the other half hangs in front of it
  bar.after.camera = {Vec3(0.09, -0.05, 0.10), Vec3(0, 0, 0.055), Vec3::UnitZ(), 30};
  expect_colours_of_regions(bar, false);  // the cut opens at the top
}

TEST(C_FUT, C_FUT_6_the_parts_hold_together_what_the_whole_held) {
  CutBar& bar = cut_bar();
  const Regions& regions = bar.scene.bodies[0].regions;
  const TriangleMesh whole(bar.scene.bodies[0].mesh);
  const RegionVolumes before = region_volumes(regions, whole.rest_body_m(), whole.triangles());
  RegionVolumes after{std::vector<double>(regions.size(), 0), 0};
  for (std::uint32_t b = 0; b < bar.simulation.body_count(); ++b) {
    const RegionVolumes part = bar.simulation.region_volumes(b);
    EXPECT_GT(part.region_m3[kTumour], 0.1 * before.region_m3[kTumour]) << "the cut divides it";
    EXPECT_NEAR(part.total_m3(), check(bar.simulation.mesh(b)).volume_m3, 5e-3 * part.total_m3())
        << "a grid of half a millimetre";
    for (std::size_t i = 0; i < regions.size(); ++i) after.region_m3[i] += part.region_m3[i];
    after.other_m3 += part.other_m3;
  }
  // A blade of templates takes what lies between the lips with it: half a millimetre of 100.
  for (std::size_t i = 0; i < regions.size(); ++i)
    EXPECT_NEAR(after.region_m3[i], before.region_m3[i], 0.03 * before.region_m3[i]);
  EXPECT_NEAR(after.total_m3(), before.total_m3(), 0.01 * before.total_m3());
}

TEST(C_FUT, C_FUT_6_vertices_know_their_region_also_those_that_a_cut_made) {
  CutBar& bar = cut_bar();
  const Regions& regions = bar.scene.bodies[0].regions;
  std::array<int, 2> made{};
  for (std::uint32_t b = 0; b < bar.simulation.body_count(); ++b) {
    const TriangleMesh& mesh = bar.simulation.mesh(b);
    for (const Triangle& t : mesh.triangles())
      for (const VertexId v : t.v) {
        if (!t.alive() || t.surface != Surface::wall) continue;
        const std::uint32_t region = bar.simulation.region_of(b, v);
        ASSERT_EQ(region, region_at(regions, mesh.rest_body_m(v)));
        if (region != kNoRegion) ++made[region];
      }
  }
  EXPECT_GT(made[kTumour], 10);
}

}  // namespace
}  // namespace sectio

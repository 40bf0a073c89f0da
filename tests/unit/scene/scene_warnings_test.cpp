#include "sim_server/scene/scene_warnings.h"

#include <cmath>

#include "tests/unit/scene/scene_file.h"

namespace sectio::scene_test {
namespace {

using Texts = std::vector<std::string>;

// A cube of 10 cm on its place, and a trace that presses it.
Scene good_scene() {
  Scene scene;
  scene.bodies.emplace_back().name = "cube";
  TriangleSoup& soup = scene.bodies[0].mesh;
  for (int i = 0; i < 8; ++i) soup.vertices_body_m.push_back(0.1 * Vec3(i & 1, (i >> 1) & 1, (i >> 2) & 1));
  soup.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  scene.bodies[0].fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, 0.06)};
  scene.world_bodies = {"cube"};
  scene.tools.emplace_back().name = "blade";
  scene.tools[0].trace = {{0, {Vec3(0, 0, 0.3), Eigen::Quaterniond::Identity()}, 0},
                          {2, {Vec3(0, 0, 0.1), Eigen::Quaterniond::Identity()}, 0}};
  return scene;
}

TEST(SceneWarnings, a_good_scene_has_none) {
  EXPECT_EQ(scene_warnings(good_scene(), 2), Texts());
}

TEST(SceneWarnings, material_beyond_soft_tissue) {
  Scene scene = good_scene();
  scene.bodies[0].material.young_pa = 6;
  EXPECT_EQ(scene_warnings(scene, 2), Texts{"cube: young_pa is 6; soft tissue has 100 Pa to 10 MPa"});
  scene.bodies[0].material.young_pa = 6e7;
  scene.bodies[0].material.density_kg_per_m3 = 1.06;
  EXPECT_EQ(scene_warnings(scene, 2), (Texts{"cube: young_pa is 6e+07; soft tissue has 100 Pa to 10 MPa",
                                             "cube: density_kg_per_m3 is 1.06; tissue has 200 to 3000 kg/m3"}));
}

TEST(SceneWarnings, a_trace_that_outlasts_the_run_or_never_comes_near) {
  Scene scene = good_scene();
  EXPECT_EQ(scene_warnings(scene, 1.5),
            Texts{"tool blade: its trace lasts 2 s, the run 1.5 s; the rest is not played"});
  EXPECT_EQ(scene_warnings(scene, HUGE_VAL), Texts());
  scene.tools[0].trace.back().pose_world.position_m = Vec3(0, 0, 0.2);
  EXPECT_EQ(scene_warnings(scene, 2),
            Texts{"tool blade: its trace is never within 5 cm of a body; has it another frame or unit?"});
  scene.world_bodies = {"cube", "elsewhere"};
  EXPECT_EQ(scene_warnings(scene, 2), Texts()) << "it may be meant for a body of another server";
}

TEST(SceneWarnings, a_long_blade_may_come_near_with_its_middle_alone) {
  Scene scene = good_scene();
  scene.tools[0].kind = "knife";
  scene.tools[0].geometry = {Vec3(0, 0, -0.5), Vec3(0, 0, 0.5), Vec3(0.002, 0, 0.4), Vec3(0.002, 0, 0.5)};
  scene.tools[0].geometry.sharp_length_m = 0.8;
  scene.tools[0].trace.back().pose_world.position_m = Vec3(0.05, 0.05, 0.05);
  EXPECT_EQ(scene_warnings(scene, 2), Texts());
}

TEST(SceneWarnings, a_body_below_the_floor) {
  Scene scene = good_scene();
  scene.floor_z_m = 0;
  EXPECT_EQ(scene_warnings(scene, 2), Texts());
  scene.floor_z_m = 0.012;
  EXPECT_EQ(scene_warnings(scene, 2), Texts{"cube: it reaches 12 mm below the floor at z = 0.012 m"});
}

TEST(SceneWarnings, a_box_or_a_camera_in_millimetres) {
  Scene scene = good_scene();
  scene.bodies[0].fixed = Box{Vec3(-10, -10, -10), Vec3(110, 110, 110)};
  EXPECT_EQ(scene_warnings(scene, 2),
            Texts{"cube: `fixed` is 207.8 m across and holds all of it; has it another unit?"});
  scene.bodies[0].fixed = Box{Vec3(-5, -5, -5), Vec3(5, 5, 5)};
  EXPECT_EQ(scene_warnings(scene, 2), Texts()) << "a tray";
  scene.camera.eye_world_m = Vec3(100, -300, 200);
  EXPECT_EQ(scene_warnings(scene, 2), Texts{"camera: no body is within 10 m of it; has it another unit?"});
}

TEST(SceneWarnings, a_region_outside_its_body) {
  Scene scene = good_scene();
  Region& region = scene.bodies[0].regions.emplace_back();
  region.name = "tumour";
  region.parts.push_back({.a_m = Vec3(0.05, 0.05, 0.05), .b_m = Vec3(0.01, 0.01, 0.01)});
  EXPECT_EQ(scene_warnings(scene, 2), Texts());
  region.parts[0].a_m *= 10;
  EXPECT_EQ(scene_warnings(scene, 2),
            Texts{"cube: its region tumour is outside of it; shapes are in the frame of the mesh, in metres"});
}

TEST(SceneWarnings, a_line_in_the_air_and_a_bin_that_nothing_reaches) {
  Scene scene = good_scene();
  const BodySpec& cube = scene.bodies[0];
  scene.exercise.emplace().body = cube.name;
  scene.exercise->line = LineSpec{{Vec3(0.02, 0.02, 0.1), Vec3(0.08, 0.02, 0.1)}};
  EXPECT_EQ(scene_warnings(scene, 2), Texts());
  scene.exercise->line->points_body_m[1].z() = 0.14;
  EXPECT_EQ(scene_warnings(scene, 2), Texts{"exercise: its line is up to 40 mm from the surface of cube"});
  scene.exercise->line.reset();
  scene.exercise->bin = Box{Vec3(-1, -1, -1), Vec3(1, 1, 1)};
  EXPECT_EQ(scene_warnings(scene, 2),
            Texts{"exercise: nothing can come into the bin: parts stay with cube (splitting: {free_parts: keep})"});
  scene.bodies[0].splitting.free_parts = FreeParts::rigid;
  EXPECT_EQ(scene_warnings(scene, 2), Texts());
}

TEST(SceneWarnings, what_is_not_played) {
  Scene scene = good_scene();
  scene.gravity_changes = {{1, Vec3(0, 1, 0)}, {3, Vec3(1, 0, 0)}};
  EXPECT_EQ(scene_warnings(scene, 2), Texts{"gravity_changes: the run lasts 2 s; nothing changes at 3 s"});
  scene.gravity_changes.clear();
  scene.tools[0].trace.front().time_s = -1;
  EXPECT_EQ(scene_warnings(scene, 2), Texts{"tool blade: its trace begins at -1 s; what is before 0 is not played"});
}

TEST(SceneWarnings, jaws_that_never_move) {
  Scene scene = good_scene();
  scene.tools[0].kind = "forceps";
  EXPECT_EQ(scene_warnings(scene, 2), Texts{"tool blade: its jaws never move: opening_rad is 0 in all of its trace"});
  scene.tools[0].trace.back().opening_rad = 0.3;
  EXPECT_EQ(scene_warnings(scene, 2), Texts());
}

TEST(SceneWarnings, bodies_that_overlap) {
  Scene scene = good_scene();
  scene.bodies.push_back(scene.bodies[0]);
  scene.bodies[1].name = "second";
  scene.bodies[1].pose.position_m = Vec3(0.05, 0.05, 0.05);
  EXPECT_EQ(scene_warnings(scene, 2), Texts{"cube and second overlap at the start"});
  scene.bodies[1].pose.position_m = Vec3(0.1, 0, 0);
  EXPECT_EQ(scene_warnings(scene, 2), Texts()) << "they touch";
  scene.bodies[1].pose = scene.bodies[0].pose;
  EXPECT_EQ(scene_warnings(scene, 2), Texts{"cube and second overlap at the start"}) << "in the same place";
}

TEST(SceneWarnings, a_body_that_nothing_holds) {
  Scene scene = good_scene();
  scene.bodies[0].fixed.reset();
  const Texts falls{"cube: nothing holds it, so it falls: `fixed` has none of its vertices, and there is no floor"};
  EXPECT_EQ(scene_warnings(scene, 2), falls) << "a surface";
  scene.bodies[0].tets = {scene.bodies[0].mesh.vertices_body_m, {{0, 1, 2, 4}}};
  EXPECT_EQ(scene_warnings(scene, 2), falls) << "a volume";
  scene.bodies[0].fixed = Box{Vec3(1, 1, 1), Vec3(2, 2, 2)};
  EXPECT_EQ(scene_warnings(scene, 2), falls) << "the box is somewhere else";
  scene.bodies[0].fixed = Box{Vec3(-1, -1, -0.01), Vec3(1, 1, 0.01)};
  EXPECT_EQ(scene_warnings(scene, 2), Texts());
  scene.bodies[0].fixed.reset();
  scene.floor_z_m = -0.1;
  EXPECT_EQ(scene_warnings(scene, 2), Texts());
}

TEST(SceneWarnings, a_part_that_nothing_holds) {
  Scene scene = good_scene();
  TriangleSoup& soup = scene.bodies[0].mesh;
  const TriangleSoup cube = soup;
  const auto add = [&](double scale, const Vec3& at_m) {
    const auto first = static_cast<std::uint32_t>(soup.vertices_body_m.size());
    for (const Vec3& p : cube.vertices_body_m) soup.vertices_body_m.push_back(scale * p + at_m);
    for (const auto& t : cube.triangles) soup.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  };
  add(0.1, Vec3(0.05, 0.05, 0.08));
  EXPECT_EQ(scene_warnings(scene, 2), Texts()) << "a cavity";
  add(1, Vec3(0, 0, 0.2));
  EXPECT_EQ(scene_warnings(scene, 2),
            Texts{"cube: 1 of its 3 parts fall: `fixed` has none of their vertices, and there is no floor"});
}

// The two organs of two_organs.yaml do touch. Bodies whose tetrahedra come from a file have no surface yet.
TEST(SceneWarnings, scenes_of_the_project_have_none_but_one) {
  for (const auto& entry : std::filesystem::directory_iterator(SECTIO_SOURCE_DIR "/deploy/scenes")) {
    if (entry.path().extension() != ".yaml") continue;
    const Scene scene = load_scene(entry.path().string(), standard_traits());
    if (!scene.bodies[0].volume.file.empty()) continue;
    const bool touch = entry.path().stem() == "two_organs";
    EXPECT_EQ(scene_warnings(scene, scene.duration_s), touch ? Texts{"liver and kidney overlap at the start"} : Texts())
        << entry.path();
  }
}

}  // namespace
}  // namespace sectio::scene_test

// Files of anatomy as they come, through the command, to scenes that run.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "common/core/error.h"
#include "common/mesh/check.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/simulation.h"
#include "tests/support/shapes.h"
#include "tests/unit/commands/run_command.h"

namespace sectio::commands_test {
namespace {

namespace fs = std::filesystem;

class OrganCommand : public testing::Test {
 protected:
  OrganCommand() : folder_(fs::path(testing::TempDir()) / ("sectio_organ_" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
  }
  ~OrganCommand() override { fs::remove_all(folder_); }

  int run(const std::vector<std::string>& words) const { return run_command("organ", organ_command, to_out(words)); }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  std::string refusal(const std::vector<std::string>& words) const {
    const std::string text = refusal_of("organ", organ_command, to_out(words));
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
    return text;
  }
  std::vector<std::string> to_out(std::vector<std::string> words) const {
    words.insert(words.end(), {"--out", (folder_ / "out").string()});
    return words;
  }

  // Two boxes in centimetres by name, the second one without its lid.
  std::string boxes() const {
    std::string text;
    for (int box = 0; box < 2; ++box) {
      text += box == 0 ? "o Liver_left\n" : "o Stomach\n";
      for (int i = 0; i < 8; ++i)
        text += "v " + std::to_string(10 * (i & 1) + 20 * box) + " " + std::to_string(6 * (i >> 1 & 1)) + " " +
                std::to_string(4 * (i >> 2)) + "\n";
      const int n = 8 * box;
      const int faces[5][4] = {{1, 3, 4, 2}, {1, 2, 6, 5}, {3, 7, 8, 4}, {1, 5, 7, 3}, {2, 4, 8, 6}};
      for (const auto& f : faces) {
        text += "f";
        for (const int corner : f) text += " " + std::to_string(corner + n);
        text += "\n";
      }
      if (box == 0) text += "f 5 6 8 7\n";
    }
    return write("boxes.obj", text);
  }

  fs::path folder_;
};

TEST_F(OrganCommand, chosen_part_becomes_a_scene_that_runs) {
  ASSERT_EQ(run({boxes(), "--unit", "cm", "--part", "liver", "--size-mm", "5", "--tissue", "liver"}), 0);
  const Scene scene = prepared(load_scene((folder_ / "out" / "scene.yaml").string(), standard_traits()));
  ASSERT_EQ(scene.bodies.size(), 1u);
  EXPECT_EQ(scene.bodies[0].material.young_pa, 5490);
  EXPECT_TRUE(scene.bodies[0].mesh_notes.empty()) << "closed, and turned outward";
  const SurfaceReport report = check_soup(scene.bodies[0].mesh);
  EXPECT_TRUE(report.valid());
  EXPECT_EQ(report.components, 1u);
  EXPECT_NEAR(report.volume_m3 / (0.1 * 0.06 * 0.04), 1, 0.02);
  Simulation simulation(scene);
  for (int i = 0; i < 200; ++i) simulation.step({});
  for (const Vec3f& x : simulation.positions_world_m(0)) ASSERT_LT(x.norm(), 0.1f);
}

TEST_F(OrganCommand, all_parts_are_taken_and_open_ones_closed) {
  ASSERT_EQ(run({boxes(), "--unit", "cm", "--size-mm", "5"}), 0);
  const Scene scene = load_scene((folder_ / "out" / "scene.yaml").string(), standard_traits());
  EXPECT_EQ(check_soup(scene.bodies[0].mesh).components, 2u);
}

TEST_F(OrganCommand, a_scene_that_is_there_stays) {
  fs::create_directories(folder_ / "out");
  write("out/scene.yaml", "# edited\n");
  EXPECT_NE(refusal({boxes(), "--unit", "cm"}).find("scene.yaml is there already"), std::string::npos);
  EXPECT_EQ(fs::file_size(folder_ / "out" / "scene.yaml"), 9u);
}

TEST_F(OrganCommand, a_hollow_with_a_thin_wall_becomes_a_solid_body) {
  // A case of 60 x 50 x 40 mm with walls of 0.4 mm and a hole of 6 mm in its lid: one closed surface that winds around
  // its wall alone. For each corner and shell: eight corners of the case, then four of the hole.
  std::string text;
  for (int shell = 0; shell < 2; ++shell) {
    const double in = 0.4 * shell;
    const auto vertex = [&](double x, double y, double z) {
      text += "v " + std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z) + "\n";
    };
    for (int i = 0; i < 8; ++i) vertex(i & 1 ? 60 - in : in, i >> 1 & 1 ? 50 - in : in, i >> 2 & 1 ? 40 - in : in);
    for (const auto& [x, y] : {std::pair(27, 22), {33, 22}, {33, 28}, {27, 28}}) vertex(x, y, 40 - in);
  }
  const auto face = [&](int a, int b, int c, int shell) {
    if (shell == 1) std::swap(b, c);
    for (const int v : {a, b, c}) text += (v == a ? "f " : " ") + std::to_string(v + 12 * shell);
    text += "\n";
  };
  const int walls[5][4] = {{1, 3, 4, 2}, {1, 2, 6, 5}, {3, 7, 8, 4}, {1, 5, 7, 3}, {2, 4, 8, 6}};
  const int lid[4] = {5, 6, 8, 7};  // around it, as the hole is
  for (const int shell : {0, 1}) {
    for (const auto& w : walls) face(w[0], w[1], w[2], shell), face(w[0], w[2], w[3], shell);
    for (int i = 0; i < 4; ++i) {
      const int j = (i + 1) % 4;
      face(lid[i], lid[j], 9 + j, shell);
      face(lid[i], 9 + j, 9 + i, shell);
    }
  }
  for (int i = 0; i < 4; ++i) {
    const int a = 9 + i, b = 9 + (i + 1) % 4;
    face(a, b, b + 12, 0);
    face(a, b + 12, a + 12, 0);
  }
  ASSERT_EQ(run({write("case.obj", text), "--unit", "mm", "--size-mm", "4"}), 0);
  const Scene scene = load_scene((folder_ / "out" / "scene.yaml").string(), standard_traits());
  EXPECT_NEAR(check_soup(scene.bodies[0].mesh).volume_m3 / (0.06 * 0.05 * 0.04), 1, 0.02);
}

// A NIfTI image of 60 x 50 x 40 voxels of 1, 1 and 1.5 mm, turned by a quarter about its third axis and moved: label 3
// is a ball of 20 mm, label 8 a ball of 6 mm in it and at its side, label 5 a rod through the middle.
constexpr int kVoxels[3] = {60, 50, 40};
std::string nifti(float one_label) {
  std::string bytes(352, '\0');
  const auto put = [&](std::size_t at, auto value) { std::memcpy(&bytes[at], &value, sizeof value); };
  put(0, std::int32_t{348});
  put(40, std::int16_t{3});
  for (std::size_t i = 0; i < 3; ++i) put(42 + 2 * i, static_cast<std::int16_t>(kVoxels[i]));
  for (std::size_t i = 3; i < 7; ++i) put(42 + 2 * i, std::int16_t{1});
  put(70, std::int16_t{16});  // float
  put(72, std::int16_t{32});
  for (std::size_t i = 0; i < 8; ++i) put(76 + 4 * i, i == 3 ? 1.5f : 1.0f);
  put(108, 352.0f);
  put(123, char{2});          // millimetres
  put(254, std::int16_t{1});  // the matrix at 280 counts
  const float matrix[12] = {0, -1, 0, 100, 1, 0, 0, -40, 0, 0, 1.5f, 7};
  for (std::size_t i = 0; i < 12; ++i) put(280 + 4 * i, matrix[i]);
  std::memcpy(&bytes[344], "n+1", 4);
  for (int z = 0; z < kVoxels[2]; ++z)
    for (int y = 0; y < kVoxels[1]; ++y)
      for (int x = 0; x < kVoxels[0]; ++x) {
        const double dx = x - 30, dy = y - 25, dz = 1.5 * (z - 20);
        float label = std::hypot(dx, dy, dz) < 20 ? one_label : 0.0f;
        if (label != 0 && std::hypot(dy, dz) < 3 && std::abs(dx) < 15) label = 5;
        if (std::hypot(dx, dy - 12, dz) < 6) label = 8;
        bytes.append(reinterpret_cast<const char*>(&label), 4);
      }
  return bytes;
}

TEST_F(OrganCommand, labels_of_an_image_are_a_body_with_regions_inside) {
  ASSERT_EQ(run({write("ct.nii", nifti(3)), "--part", "3", "--inside", "8", "--inside", "5", "--size-mm", "4"}), 0);
  const Scene scene = prepared(load_scene((folder_ / "out" / "scene.yaml").string(), standard_traits()));
  EXPECT_NEAR(check_soup(scene.bodies[0].mesh).volume_m3 / (4.0 / 3 * M_PI * 8e-6), 1, 0.03);
  const Regions& regions = scene.bodies[0].regions;
  ASSERT_EQ(regions.size(), 2u);
  EXPECT_EQ(regions[0].name, "label_8");
  Simulation simulation(scene);
  const double ball_m3 = simulation.region_volumes(0).region_m3[0];
  EXPECT_NEAR(ball_m3 / (4.0 / 3 * M_PI * 2.16e-7), 1, 0.1);
  // In the image's frame the ball lies at -x of the middle: the image's second axis points there.
  EXPECT_EQ(region_at(regions, Vec3(-0.012, 0, 0)), 0u);
  EXPECT_EQ(region_at(regions, Vec3(0.012, 0, 0)), kNoRegion);
  EXPECT_EQ(region_at(regions, Vec3(0, 0.012, 0)), 1u) << "the rod lies along the image's first axis";
  EXPECT_EQ(region_at(regions, Vec3(0, 0, 0.012)), kNoRegion);
  for (int i = 0; i < 50; ++i) simulation.step({});
}

// A reader of meshes gives each triangle corners of its own.
TEST_F(OrganCommand, a_part_of_a_file_of_meshes_is_a_region_inside) {
  std::string text;
  int first = 1;
  for (const auto& [name, radii_m] :
       {std::pair{"liver", Vec3(0.05, 0.04, 0.03)}, {"tumour", Vec3(0.015, 0.01, 0.012)}}) {
    const TriangleSoup soup = test::ellipsoid(3, radii_m);
    text += std::string("o ") + name + "\n";
    for (const Vec3& p : soup.vertices_body_m)
      text += "v " + std::to_string(p.x()) + " " + std::to_string(p.y()) + " " + std::to_string(p.z()) + "\n";
    for (const auto& t : soup.triangles)
      text += "f " + std::to_string(t[0] + first) + " " + std::to_string(t[1] + first) + " " +
              std::to_string(t[2] + first) + "\n";
    first += static_cast<int>(soup.vertices_body_m.size());
  }
  ASSERT_EQ(run({write("parts.obj", text), "--part", "liver", "--inside", "tumour", "--size-mm", "6"}), 0);
  const Scene scene = load_scene((folder_ / "out" / "scene.yaml").string(), standard_traits());
  const Regions& regions = scene.bodies[0].regions;
  ASSERT_EQ(regions.size(), 1u);
  EXPECT_EQ(region_at(regions, Vec3(0.013, 0, 0)), 0u);
  EXPECT_EQ(region_at(regions, Vec3(0, 0, 0.01)), 0u);
  EXPECT_EQ(region_at(regions, Vec3(0.018, 0, 0)), kNoRegion);
}

TEST_F(OrganCommand, a_bad_image_is_refused_in_one_line) {
  const std::string good = write("ct.nii", nifti(3));
  EXPECT_NE(refusal({good, "--part", "4"}).find("no label 4; there are 3, 5, 8"), std::string::npos);
  EXPECT_NE(refusal({good, "--part", "liver"}).find("expected numbers of labels"), std::string::npos);
  EXPECT_NE(refusal({good, "--part", "3", "--unit", "mm"}).find("the unit must be m"), std::string::npos);
  EXPECT_NE(refusal({good, "--part", "3", "--inside", "9"}).find("no label 9"), std::string::npos);
  const std::string bytes_of_image = nifti(3);
  for (const std::size_t lost : {std::size_t{1}, bytes_of_image.size() / 2})
    EXPECT_NE(refusal({write("torn.nii", bytes_of_image.substr(0, bytes_of_image.size() - lost)), "--part", "3"})
                  .find("damaged file: it ends after"),
              std::string::npos);
  ASSERT_EQ(std::system(("gzip -kf '" + good + "'").c_str()), 0);
  std::ifstream packed(good + ".gz", std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(packed)), {});
  EXPECT_EQ(run({good + ".gz", "--part", "3,5,8", "--size-mm", "4"}), 0);
  fs::remove_all(folder_ / "out");
  EXPECT_NE(refusal({write("torn.nii.gz", bytes.substr(0, bytes.size() / 2))}).find("not whole"), std::string::npos);
  EXPECT_NE(refusal({write("ct.nii", nifti(2.5f))}).find("are no labels"), std::string::npos);
  EXPECT_NE(refusal({write("text.nii", "once upon a time\n")}), "");
}

TEST_F(OrganCommand, bad_input_is_one_line) {
  EXPECT_NE(refusal({boxes(), "--unit", "cm", "--part", "spleen"}).find("there are Liver_left, Stomach"),
            std::string::npos);
  EXPECT_NE(refusal({(folder_ / "none.obj").string()}).find("no such file"), std::string::npos);
  EXPECT_NE(refusal({write("text.obj", "once upon a time\n")}), "");
  EXPECT_NE(refusal({write("sheet.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")}).find("enclose nothing"),
            std::string::npos);
  EXPECT_NE(refusal({boxes(), "--unit", "cm", "--size-mm", "0.01"}).find("too small"), std::string::npos);
  EXPECT_NE(refusal({boxes(), "--tissue", "bone"}).find("expected one of brain"), std::string::npos);
}

TEST_F(OrganCommand, a_body_that_no_scene_would_take_is_refused_and_leaves_nothing) {
  const std::string why = refusal({boxes(), "--unit", "m"});
  EXPECT_TRUE(why.starts_with("--unit m: ")) << why;
  EXPECT_NE(why.find("boxes.obj: the mesh would be 30."), std::string::npos) << why;
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

TEST_F(OrganCommand, a_scene_wraps_its_mesh_itself) {
  boxes();
  const std::string scene =
      "session: s\nbodies:\n  - name: b\n    fixed: {min_world_m: [-1, -1, -1], max_world_m: [1, 1, 0.001]}\n"
      "    mesh: {file: boxes.obj, unit: cm, repair: wrap, part: stomach, size_m: 0.006}\n";
  const Scene loaded = load_scene(write("s.yaml", scene), standard_traits());
  EXPECT_TRUE(check_soup(loaded.bodies[0].mesh).valid());
  ASSERT_FALSE(loaded.bodies[0].mesh_notes.empty());
  EXPECT_NE(loaded.bodies[0].mesh_notes.back().find("wrapped: "), std::string::npos);
  std::string mended = scene;
  mended.replace(mended.find("repair: wrap, "), 14, "");
  try {
    load_scene(write("s.yaml", mended), standard_traits());
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("it is of repair: wrap"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace sectio::commands_test

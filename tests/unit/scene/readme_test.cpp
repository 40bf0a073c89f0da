// The scene that a visitor copies from the README must load.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "sim_server/engine/standard_traits.h"
#include "sim_server/scene/scene.h"

namespace sectio::scene_test {
namespace {

namespace fs = std::filesystem;

TEST(Readme, its_scene_loads_and_has_about_ten_lines) {
  std::ifstream in(fs::path(SECTIO_SOURCE_DIR) / "README.md");
  const std::string readme{std::istreambuf_iterator<char>(in), {}};
  const std::string mark = "```yaml\n";
  const std::size_t from = readme.find(mark) + mark.size();
  ASSERT_GE(from, mark.size());
  const std::string text = readme.substr(from, readme.find("```", from) - from);
  EXPECT_LE(std::ranges::count(text, '\n'), 12);

  std::string name = (fs::temp_directory_path() / "sectio_readme_XXXXXX").string();
  ASSERT_NE(mkdtemp(name.data()), nullptr);
  const fs::path folder = name;
  fs::create_directory_symlink(fs::path(SECTIO_SOURCE_DIR) / "deploy", folder / "deploy");
  std::ofstream(folder / "my.yaml") << text;
  const Scene scene = load_scene((folder / "my.yaml").string(), standard_traits());
  fs::remove_all(folder);
  ASSERT_EQ(scene.bodies.size(), 1u);
  EXPECT_FALSE(scene.bodies[0].mesh.triangles.empty());
  ASSERT_EQ(scene.tools.size(), 1u);
  EXPECT_FALSE(scene.tools[0].trace.empty());
}

}  // namespace
}  // namespace sectio::scene_test

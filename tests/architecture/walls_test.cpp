// Debian puts every library on one include path, so linking can't keep rooms apart: this reads the #includes.
#include "tests/architecture/walls.h"

#include <gtest/gtest.h>

#include <map>
#include <regex>
#include <set>

#include "tests/architecture/source_files.h"

namespace sectio {
namespace {

std::map<std::string, std::string> files(const std::set<std::string>& endings) {
  return test::source_files(test::kSourceFolders, endings);
}

std::string join(const std::vector<std::string>& lines) {
  std::string all;
  for (const std::string& line : lines) all += line + "\n";
  return all;
}

TEST(Walls, every_include_stays_inside_its_rooms_walls) {
  const auto sources = files({".h", ".cpp"});
  ASSERT_GT(sources.size(), 100u);
  for (const auto& [path, text] : sources) EXPECT_EQ(join(walls_broken(path, text)), "");
}

TEST(Walls, every_file_is_tidy_and_short) {
  const auto texts = files({".h", ".cpp", ".idl", ".txt", ".yaml", ".xml", ".supp", ""});
  for (const auto& [path, text] : texts) EXPECT_EQ(join(untidy(path, text)), "");
}

TEST(Walls, every_row_of_the_table_stands_for_files) {
  const auto sources = files({".h", ".cpp"});
  for (const Room& room : rooms()) {
    const bool used =
        std::any_of(sources.begin(), sources.end(), [&](const auto& s) { return room_of(s.first) == &room; });
    EXPECT_TRUE(used) << room.path;
  }
}

struct Breach {
  const char* path;
  const char* line;
};

TEST(Walls, breaches_are_seen) {
  const Breach breaches[] = {
      {"common/mesh/check.cpp", "#include <spdlog/spdlog.h>"},
      {"common/mesh/check.cpp", "#include \"common/delta/apply.h\""},
      {"common/delta/apply.cpp", "#include \"common/dds/qos.h\""},
      {"sim_server/surface/cutting/stroke.cpp", "#include \"sim_server/collision/contact.h\""},
      {"sim_server/surface/cutting/stroke.cpp", "#include \"sim_server/scene/scene.h\""},
      {"sim_server/deformation/springs.cpp", "  #  include <fcl/fcl.h>"},
      {"sim_server/simulation.cpp", "#include \"common/dds/participant.h\""},
      {"sim_server/simulation.cpp", "#include \"sim_server/net/server_net.h\""},
      {"sim_server/net/server_net.cpp", "#include \"render_client/replica/replica.h\""},
      {"sim_server/main.cpp", "#include <yaml-cpp/yaml.h>"},
      {"render_client/replica/replica.cpp", "#include \"common/dds/endpoint.h\""},
      {"render_client/replica/replica.cpp", "#include <GL/osmesa.h>"},
      {"render_client/draw/draw_frame.cpp", "#include <GL/gl.h>"},
      {"render_client/main.cpp", "#include \"sim_server/world/step_io.h\""},
      {"render_client/main.cpp", "#include <fastdds/dds/topic/Topic.hpp>"},
      {"render_client/output/video.cpp", "#include <png.h>"},
      {"device_bridge/servo/servo_loop.cpp", "#include \"device_bridge/net/bridge_net.h\""},
      {"tests/unit/scene/scene_test.cpp", "#include <assimp/scene.h>"},
      {"elsewhere/new_room.cpp", "#include <vector>"},
  };
  for (const Breach& b : breaches) EXPECT_EQ(walls_broken(b.path, b.line).size(), 1u) << b.path << " " << b.line;
}

TEST(Walls, what_is_allowed_passes) {
  const Breach allowed[] = {
      {"common/core/log.cpp", "#include <spdlog/spdlog.h>"},
      {"common/core/error.cpp", "#include <cstdio>"},
      {"sim_server/collision/surface_tree.cpp", "#include <fcl/fcl.h>"},
      {"sim_server/scene/yaml_value.cpp", "#include <yaml-cpp/yaml.h>"},
      {"sim_server/haptics/fitter.h", "#include \"common/math/contact_model.h\""},
      {"render_client/draw/gl_canvas.cpp", "#include <GL/osmesa.h>"},
      {"render_client/output/video.cpp", "#include <sys/socket.h>"},
      {"common/dds/qos.cpp", "#include <fastdds/dds/core/policy/QosPolicies.hpp>"},
      {"common/math/types.h", "// see #include <GL/gl.h>"},
  };
  for (const Breach& a : allowed) EXPECT_EQ(join(walls_broken(a.path, a.line)), "");
}

TEST(Walls, headers_of_libraries_stay_out_of_headers_of_ours) {
  // A library lives behind a header that names none of its types.
  const std::set<std::string> hidden = {"fcl/", "yaml-cpp/", "assimp/",    "spdlog/", "CLI/",
                                        "GL/",  "png.h",     "ft2build.h", "SDL2/",   "imgui.h"};
  const std::string opengls = "render_client/draw/gl_functions.h";  // for sources that draw by OpenGL
  for (const auto& [path, text] : files({".h"})) {
    if (path == opengls) continue;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);)
      for (const std::string& library : hidden)
        EXPECT_FALSE(included(line).starts_with(library)) << path << ": " << line;
  }
}

// A reader of a class has one header and one source to read. Two programs may have classes of one name.
TEST(Walls, a_class_is_implemented_in_one_source) {
  const std::set<std::string> allowed = {
      "render_client/page/browser/no_overlay.cpp",  // stands in for Text's own source where there is no FreeType
  };
  std::map<std::string, std::string> source_of;
  for (const std::string program : {"common/", "sim_server/", "render_client/", "device_bridge/"})
    for (const auto& [path, text] : test::source_files({program}, {".cpp"}))
      for (const std::string& name : classes_implemented(text)) {
        if (allowed.contains(path)) continue;
        const auto [known, is_new] = source_of.try_emplace(program + name, path);
        EXPECT_TRUE(is_new) << name << " is implemented in " << known->second << " and in " << path;
      }
  EXPECT_GT(source_of.size(), 100u);
}

TEST(Walls, classes_are_seen) {
  const std::set<std::string> seen = classes_implemented(
      "Tool::Tool(int id) : id_(id) {}\n"
      "std::optional<Hand::Grip> Grasp::Held::grip(const Point& p) {\n"
      "const Vec3& Body::at() const {\n  Blade::of(x);\n"
      "Stroke::~Stroke() = default;\nvoid follow(Pose::Parts& parts) {\n// Text::says(nothing)\n");
  EXPECT_EQ(seen, (std::set<std::string>{"Body", "Grasp", "Stroke", "Tool"}));
}

// A suite is a noun in PascalCase or the family of rows of docs/rows.md that its tests prove; a test is a sentence.
TEST(Walls, tests_are_named_in_one_style) {
  const std::regex test(R"(^TEST(?:_F|_P)?\((\w+),\s*(\w*))");
  const std::regex suite("[A-Z][A-Za-z0-9]+|[ABC]_[A-Z]+"), sentence("([ABCDS]_([A-Z0-9]+_)*)?[a-z0-9][a-z0-9_]*");
  std::size_t checked = 0;
  for (const auto& [path, text] : test::source_files({"tests"}, {".cpp"})) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      std::smatch name;
      if (!std::regex_search(line, name, test)) continue;
      EXPECT_TRUE(path.ends_with("_test.cpp")) << path;
      EXPECT_TRUE(std::regex_match(name[1].str(), suite)) << path << ": " << line;
      EXPECT_TRUE(name[2].length() == 0 || std::regex_match(name[2].str(), sentence)) << path << ": " << line;
      ++checked;
    }
  }
  EXPECT_GT(checked, 500u);
}

// Their seeds can then be moved, all at once.
TEST(Walls, tests_draw_from_random_numbers_of_their_own_header) {
  const std::string engine = std::string("mt") + "19937";
  std::size_t drawing = 0;
  for (const auto& [path, text] : test::source_files({"tests"}, {".cpp", ".h"})) {
    drawing += text.find("tests/support/random.h") != std::string::npos;
    if (path == "tests/support/random.h" || path.starts_with("tests/bench/")) continue;
    EXPECT_EQ(text.find(engine), std::string::npos) << path;
  }
  EXPECT_GT(drawing, 40u);
}

TEST(Walls, untidy_text_is_seen) {
  EXPECT_EQ(untidy("a.cpp",
                   "// TO"
                   "DO: later\n")
                .size(),
            1u);
  EXPECT_EQ(untidy("a.cpp",
                   "open(\"/tm"
                   "p/x\");\n")
                .size(),
            1u);
  EXPECT_EQ(untidy("a.cpp", std::string(kMaxLines, '\n')).size(), 0u);
  EXPECT_EQ(untidy("a.cpp", std::string(kMaxLines + 1, '\n')).size(), 1u);
}

}  // namespace
}  // namespace sectio

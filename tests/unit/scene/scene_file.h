// A scene in a folder of its own, with its mesh and its trace.
#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "common/core/error.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/scene/scene.h"

namespace sectio::test {

inline const char* const kScene = R"(session: test
step_s: 0.002
duration_s: 3
gravity_m_per_s2: [0, 0, -1]
camera: {eye_world_m: [0, -1, 1], target_world_m: [0, 0, 0], up_world: [0, 0, 1], field_of_view_deg: 40}
bodies:
  - name: cube
    mesh: {file: cube.obj, unit: cm}
    pose: {position_world_m: [1, 2, 3], rotation_deg: [0, 0, 90]}
    model: surface_springs
    material: {young_pa: 7000, poisson: 0.4}
    cutting: {threshold_force_n: 0.3, hysteresis: 0.5}
    fixed: {min_world_m: [0, 0, 0], max_world_m: [1, 1, 1]}
    colours: {skin: [1, 0, 0], wall: [0, 1, 0]}
    contact: {style: templates}
tools:
  - {name: knife, kind: scalpel, trace: knife.csv}
  - {name: hook, kind: cautery_hook, intensity: 0.5}
)";

class SceneFile : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "sectio_scene_XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    write("cube.obj",
          "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n"
          "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n");
    write("knife.csv", "time_s,x_world_m,y_world_m,z_world_m,qw,qx,qy,qz\n0,0,0,0.1,1,0,0,0\n1,0,0,0,1,0,0,0\n");
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const { std::ofstream(folder_ / name) << text; }

  Scene load(const std::string& text) const {
    write("s.yaml", text);
    return load_scene((folder_ / "s.yaml").string(), traits_);
  }

  // kScene with `from` replaced by `to`.
  static std::string with(const std::string& from, const std::string& to) {
    std::string text = kScene;
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  }

  // The message for that scene, less the file's folder; "" when it loads.
  std::string refusal(const std::string& from, const std::string& to) const {
    try {
      load(with(from, to));
    } catch (const InputError& error) {
      std::string message = error.what();
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
      for (std::size_t i; (i = message.find(folder_.string() + "/")) != std::string::npos;) {
        message.erase(i, folder_.string().size() + 1);
      }
      return message;
    }
    return "";
  }

  EngineTraits traits_ = standard_traits();
  std::filesystem::path folder_;
};

}  // namespace sectio::test

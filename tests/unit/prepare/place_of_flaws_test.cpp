// Flaws of a scene that only show when it is made ready, or begins.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "common/core/error.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/simulation.h"

namespace sectio::prepare_test {
namespace {

class PlaceOfFlaws : public testing::Test {
 protected:
  ~PlaceOfFlaws() override { std::filesystem::remove(file_); }

  // Without the name of the file.
  std::string refusal(const std::string& step_s, const std::string& model) const {
    std::ofstream(file_) << "session: s\nstep_s: " + step_s + "\nbodies:\n  - name: bar\n    mesh: {file: " +
                                SECTIO_SOURCE_DIR "/deploy/meshes/bar.obj, unit: m}\n    model: " + model + "\n";
    try {
      const Simulation simulation(prepared(load_scene(file_, standard_traits())));
    } catch (const InputError& error) {
      const std::string text = error.what();
      return text.starts_with(file_) ? text.substr(file_.size()) : text;
    }
    return "";
  }

  std::string file_ = testing::TempDir() + "flaws_" + std::to_string(::getpid()) + ".yaml";
};

TEST_F(PlaceOfFlaws, of_a_body_is_its_line) {
  const std::string why = refusal("0.001", "neo_hookean_lattice\n    volume: {cell_m: 0.2}");
  EXPECT_TRUE(why.starts_with(":4: body 'bar': volume: cell_m: ")) << why;
}

TEST_F(PlaceOfFlaws, of_a_step_is_its_line) {
  const std::string why = refusal("0.02", "surface_springs\n    material: {young_pa: 1e9}");
  EXPECT_TRUE(why.starts_with(":2: step_s: 0.02 s is beyond the stable step of body 'bar'")) << why;
  const std::string free = refusal("auto", "surface_springs\n    material: {young_pa: 1e12}");
  EXPECT_TRUE(free.starts_with(":2: step_s: no step is short enough")) << free;
}

}  // namespace
}  // namespace sectio::prepare_test

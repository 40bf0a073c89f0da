// Instruments at tissue that can't move: it resists them, and a blade that goes into it cuts where it is.
#include <gtest/gtest.h>

#include "tests/support/block_scene.h"
#include "tests/support/operation.h"

namespace sectio::test {
namespace {

Scene fixed_block(const std::string& model, const std::string& tool, const Box& fixed) {
  Scene scene = block_scene(model);
  scene.gravity_m_per_s2 = Vec3::Zero();
  scene.bodies[0].fixed = fixed;
  ToolSpec spec;
  spec.name = spec.kind = tool;
  spec.geometry = instrument_of(tool).geometry;
  if (tool == "knife") {
    spec.geometry = {Vec3::Zero(), Vec3(0, 0, 0.08), Vec3(0.002, 0, 0.06), Vec3(0.002, 0, 0.08)};
    spec.geometry.sharp_length_m = 0.06;
  }
  scene.tools = {spec};
  return scene;
}

class FixedTissue : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Models, FixedTissue, testing::Values("tetra_springs", "neo_hookean", "neo_hookean_lattice"),
                         [](const auto& model) { return std::string(model.param); });

// The knife goes straight down and then on: nothing behind the place where it went in may open.
TEST_P(FixedTissue, is_cut_from_where_the_blade_goes_in) {
  constexpr double kIn_m = -0.014, kBehind_m = 0.006;
  Operation op(fixed_block(GetParam(), "knife", Box{Vec3(-1, -1, -1), Vec3(-0.005, 1, 1)}));
  op.place(Vec3(kIn_m, 0.001, kBlockTop_m + 0.01));
  op.move(Vec3(kIn_m, 0.001, kBlockTop_m - 0.012), 0.03);
  op.move(Vec3(kIn_m + 0.015, 0.001, kBlockTop_m - 0.012), 0.03);
  const TriangleMesh& mesh = op.simulation.mesh(0);
  std::size_t walls = 0;
  for (const Triangle& t : mesh.triangles()) {
    if (!t.alive() || t.surface != Surface::wall) continue;
    ++walls;
    for (const VertexId v : t.v) EXPECT_GT(op.simulation.positions_world_m(0)[v].x(), kIn_m - kBehind_m);
  }
  EXPECT_GT(walls, 4u);
}

TEST_P(FixedTissue, presses_back) {
  Operation op(fixed_block(GetParam(), "probe", Box{Vec3(-1, -1, -1), Vec3(1, 1, 1)}));
  op.place(Vec3(0.001, 0.001, kBlockTop_m + 0.01));
  op.move(Vec3(0.001, 0.001, kBlockTop_m - 0.001), 0.02);
  EXPECT_GT(op.last.contacts.at(0).force_world_n.z(), 0.5);
}

}  // namespace
}  // namespace sectio::test

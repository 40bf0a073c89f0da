#include <gtest/gtest.h>

#include "common/core/error.h"
#include "common/mesh/tet_mesh.h"
#include "sim_server/meshing/tet_file.h"
#include "tests/unit/commands/run_command.h"

namespace sectio::commands_test {
namespace {

int run(const std::vector<std::string>& words) {
  return run_command("mesh", mesh_command, words);
}

const std::string kLiver = SECTIO_SOURCE_DIR "/deploy/meshes/liver_2k.obj";

TEST(MeshCommand, C_IMP_1_an_organ_in_one_command_cut_in_four) {
  const std::string out = testing::TempDir() + "/sectio_mesh_command.vtk";
  EXPECT_EQ(run({kLiver, "--tetrahedra", "3000", "--cut", "0,0,0,1,0.2,0.1", "--cut", "0,0,0,0,1,0", "--tets", out}),
            0);
  const TetReport report = check(read_tet_file(out, 1).mesh);
  EXPECT_TRUE(report.valid) << report.first_defect;
  EXPECT_EQ(report.components, 4u);
  EXPECT_EQ(run({out}), 0);
}

TEST(MeshCommand, a_place_that_takes_no_file_is_told_before_the_work) {
  const auto refusal = [](const std::string& out) {
    testing::internal::CaptureStdout();
    const std::string why = refusal_of("mesh", mesh_command, {kLiver, "--tetrahedra", "1000", "--tets", out});
    EXPECT_EQ(testing::internal::GetCapturedStdout(), "") << "it worked before it said so";
    return why;
  };
  EXPECT_EQ(refusal("/nowhere/organ.vtk"), "/nowhere/organ.vtk: can't be written: No such file or directory");
  EXPECT_EQ(refusal("organ.foo"), "organ.foo: expected a name that ends in .msh, .vtk, .node or .ele");
}

TEST(MeshCommand, C_IMP_1_what_can_t_be_done_is_refused) {
  EXPECT_THROW(run({kLiver, "--tetrahedra", "3"}), InputError);
  EXPECT_THROW(run({kLiver, "--cut", "0,0,0"}), InputError);
  EXPECT_THROW(run({kLiver, "--cut", "0,0,0,0,0,0"}), InputError);
  EXPECT_THROW(run({kLiver, "--poisson", "0.5"}), InputError);
  EXPECT_THROW(run({kLiver, "--tets", "organ.stl", "--tetrahedra", "1000"}), InputError);
  EXPECT_THROW(run({"nothing.obj"}), InputError);
}

}  // namespace
}  // namespace sectio::commands_test

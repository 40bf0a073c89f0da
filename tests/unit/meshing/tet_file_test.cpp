#include "sim_server/meshing/tet_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "common/core/error.h"
#include "sim_server/meshing/lattice_mesher.h"
#include "tests/support/shapes.h"

namespace sectio::meshing_test {
namespace {

class TetFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("sectio_tet_file_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name)) << text;
    return path(name);
  }
  std::string refusal(const std::string& name, const std::string& text) const {
    try {
      read_tet_file(write(name, text), 1);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

 private:
  std::filesystem::path folder_;
};

TEST_F(TetFiles, every_format_gives_back_what_was_written) {
  const TetMesh mesh = fill_with_lattice(test::ellipsoid(2, Vec3(0.05, 0.04, 0.03)), 0.02);
  for (const char* name : {"a.msh", "a.vtk", "a.node", "a.ele"}) {
    write_tet_file(path(name), mesh);
    const TetFile back = read_tet_file(path(name), 1);
    EXPECT_EQ(back.mesh.tetrahedra, mesh.tetrahedra) << name;
    EXPECT_EQ(back.mesh.vertices_body_m, mesh.vertices_body_m) << name;
    EXPECT_TRUE(back.notes.empty()) << name << ": " << back.notes[0];
  }
  EXPECT_NEAR(check(read_tet_file(path("a.msh"), 0.001).mesh).volume_m3, 1e-9 * check(mesh).volume_m3, 1e-18);
  EXPECT_THROW(write_tet_file(path("a.obj"), mesh), InputError);
}

constexpr const char* kMsh41 = R"($MeshFormat
4.1 0 8
$EndMeshFormat
$Nodes
1 5 1 9
3 1 0 5
1
2
3
9
8
0 0 0
1 0 0
0 1 0
0 0 1
7 7 7
$EndNodes
$Elements
2 2 1 2
2 1 2 1
1 1 2 3
3 1 4 1
2 1 2 3 9
$EndElements
)";

TEST_F(TetFiles, gmsh_4_with_other_elements_and_unused_vertices) {
  const TetFile file = read_tet_file(write("g.msh", kMsh41), 1);
  EXPECT_EQ(file.mesh.vertices_body_m.size(), 4u);
  EXPECT_NEAR(check(file.mesh).volume_m3, 1.0 / 6, 1e-15);
  EXPECT_EQ(file.notes.size(), 2u);
}

TEST_F(TetFiles, corners_counted_the_other_way_round_are_turned) {
  std::string text = kMsh41;
  text.replace(text.find("2 1 2 3 9"), 9, "2 1 3 2 9");
  EXPECT_NEAR(check(read_tet_file(write("t.msh", text), 1).mesh).volume_m3, 1.0 / 6, 1e-15);
}

constexpr const char* kNodes = "6 3 0 0  # two tetrahedra\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n4 1 1 1\n5 5 5 5\n";

TEST_F(TetFiles, tetrahedra_that_can_t_serve_are_refused_with_the_place) {
  write("a.node", kNodes);
  EXPECT_EQ(refusal("a.ele", "2 4 0\n0 0 1 2 3\n1 1 2 3 4\n"), "");
  EXPECT_NE(refusal("a.ele", "2 4 0\n0 0 1 2 3\n1 1 3 2 4\n").find("inverted"), std::string::npos);
  EXPECT_NE(refusal("a.ele", "2 4 0\n0 0 1 2 3\n1 0 1 2 4\n").find("same side"), std::string::npos);
  EXPECT_NE(refusal("a.ele", "2 4 0\n0 0 1 2 3\n1 0 1 2 7\n").find("a.ele:3: no vertex has the number 7"),
            std::string::npos);
}

TEST_F(TetFiles, damaged_files_are_refused_with_the_line) {
  write("b.node", "100000000 3 0 0\n0 0 0 0\n");
  EXPECT_NE(refusal("b.ele", "1 4 0\n0 0 1 2 3\n").find("b.node:1: the file is too short"), std::string::npos);
  EXPECT_NE(refusal("c.msh", "$MeshFormat\n2.2 1 8\n").find("c.msh:2: binary"), std::string::npos);
  EXPECT_NE(
      refusal("d.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n2\n1 0 0 zero\n").find("d.msh:6: expected a"),
      std::string::npos);
  EXPECT_NE(refusal("e.vtk", "# vtk DataFile Version 3.0\nx\nBINARY\n").find("e.vtk:3: binary"), std::string::npos);
  EXPECT_NE(refusal("f.vtk", "").find("ends too early"), std::string::npos);
  EXPECT_THROW(read_tet_file(path("none.msh"), 1), InputError);
  // Every prefix of a good file is refused, or is read; none crashes.
  const std::string good = kMsh41;
  for (std::size_t n = 0; n < good.size(); ++n) refusal("p.msh", good.substr(0, n));
}

}  // namespace
}  // namespace sectio::meshing_test

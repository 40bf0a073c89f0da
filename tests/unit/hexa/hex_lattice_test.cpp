#include "sim_server/deformation/hexa/hex_lattice.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "sim_server/volume/tets/tet_cut.h"
#include "tests/support/tet_shapes.h"

namespace sectio::hexa_test {
namespace {

TetMesh bar(int n = 4) {
  return test::tet_box(2 * n, n, n, Vec3(0.04, 0.02, 0.02));
}

double filled(const HexLattice& lattice) {
  double sum = 0;
  for (const HexCell& cell : lattice.cells) sum += cell.fill;
  return sum;
}

// The number of pieces into which cells with common nodes divide the material.
std::size_t parts(const HexLattice& lattice) {
  std::vector<std::uint32_t> label(lattice.nodes.size());
  for (std::uint32_t n = 0; n < label.size(); ++n) label[n] = n;
  for (bool changed = true; changed;) {
    changed = false;
    for (const HexCell& cell : lattice.cells) {
      std::uint32_t least = kNone;
      for (const auto n : cell.nodes) least = std::min(least, label[n]);
      for (const auto n : cell.nodes) changed |= std::exchange(label[n], least) != least;
    }
  }
  return std::set(label.begin(), label.end()).size();
}

TetMesh cut_along(const TetMesh& mesh, const std::vector<std::vector<Vec3>>& sheets) {
  TetTopology volume(mesh);
  for (const auto& outline : sheets) cut(volume, {outline}, {});
  return volume.mesh();
}
std::vector<Vec3> across_at(double x, double deep = 1) {
  return {Vec3(x, -1, 0.02 + 1), Vec3(x, 1, 0.02 + 1), Vec3(x, 1, 0.02 - deep), Vec3(x, -1, 0.02 - deep)};
}

TEST(GridPieces, add_up_to_the_whole) {
  const std::array<Vec3, 4> tet{Vec3(-0.3, 0.2, 0), Vec3(2.7, 0.4, 0.1), Vec3(0.5, 3, 0.6), Vec3(1, 1, 2.2)};
  std::vector<GridPiece> pieces;
  pieces_of(tet, pieces);
  double sum = 0;
  Vec3 centroid = Vec3::Zero();
  for (const GridPiece& p : pieces) {
    sum += p.size;
    centroid += p.size * p.centroid;
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_GE(p.centroid[static_cast<Eigen::Index>(k)], p.cell[k]);
      EXPECT_LE(p.centroid[static_cast<Eigen::Index>(k)], p.cell[k] + 1);
    }
  }
  const double whole = tet_volume_m3(tet[0], tet[1], tet[2], tet[3]);
  EXPECT_NEAR(sum, std::abs(whole), 1e-12);
  EXPECT_LT((centroid / sum - 0.25 * (tet[0] + tet[1] + tet[2] + tet[3])).norm(), 1e-12);
  EXPECT_GT(pieces.size(), 8u);
  pieces_of(std::array<Vec3, 3>{tet[0], tet[1], tet[2]}, pieces);
  sum = 0;
  for (const GridPiece& p : pieces) sum += p.size;
  EXPECT_NEAR(sum, 0.5 * (tet[1] - tet[0]).cross(tet[2] - tet[0]).norm(), 1e-12);
}

TEST(HexLattice, a_box_of_whole_cells_is_filled_by_them) {
  for (const int n : {1, 2, 4, 5}) {
    const TetMesh mesh = bar();
    const HexLattice lattice = lattice_of(mesh, grid_around(mesh, 0.02 / n));
    EXPECT_EQ(lattice.cells.size(), static_cast<std::size_t>(2 * n * n * n));
    EXPECT_EQ(lattice.nodes.size(), static_cast<std::size_t>((2 * n + 1) * (n + 1) * (n + 1)));
    for (const HexCell& cell : lattice.cells) {
      EXPECT_NEAR(cell.fill, 1, 1e-9);
      EXPECT_NEAR(cell.stiffness, 1, 1e-12);
      for (int c = 0; c < 8; ++c)
        for (std::size_t k = 0; k < 3; ++k)
          EXPECT_EQ(lattice.nodes[cell.nodes[static_cast<std::size_t>(c)]][k], cell.place[k] + (c >> k & 1));
    }
  }
}

TEST(HexLattice, vertices_ride_where_they_are) {
  TetMesh mesh = bar(3);
  test::jitter(mesh, 0.001);
  const HexLattice lattice = lattice_of(mesh, grid_around(mesh, 0.0047));
  EXPECT_NEAR(filled(lattice) * std::pow(0.0047, 3), check(mesh).volume_m3, 1e-15);
  for (VertexId v = 0; v < mesh.vertices_body_m.size(); ++v) {
    const HexPoint& p = lattice.points[v];
    Vec3 at = Vec3::Zero();
    for (std::size_t c = 0; c < 8; ++c) at += p.weight(c) * lattice.rest_m(lattice.cells[p.cell].nodes[c]);
    EXPECT_LT((at - mesh.vertices_body_m[v]).norm(), 1e-12);
    EXPECT_GT(p.local.minCoeff(), -1e-6);
    EXPECT_LT(p.local.maxCoeff(), 1 + 1e-6);
  }
}

TEST(HexLattice, a_cut_through_the_middle_of_cells_copies_them) {
  const TetMesh mesh = bar();
  const Grid grid = grid_around(mesh, 0.005);
  const TetMesh halves = cut_along(mesh, {across_at(0.0172)});
  const HexLattice whole = lattice_of(mesh, grid), lattice = lattice_of(halves, grid);
  EXPECT_EQ(parts(whole), 1u);
  EXPECT_EQ(parts(lattice), 2u);
  EXPECT_EQ(lattice.cells.size(), whole.cells.size() + 16);
  EXPECT_NEAR(filled(lattice), filled(whole), 1e-9);
  std::map<GridPlace, double> by_place;
  for (const HexCell& cell : lattice.cells) by_place[cell.place] += cell.fill;
  for (const auto& [place, fill] : by_place) EXPECT_NEAR(fill, 1, 1e-9);
  const std::vector<std::uint32_t> from = cells_before(lattice, whole, mesh);
  for (std::uint32_t c = 0; c < from.size(); ++c) EXPECT_EQ(lattice.cells[c].place, whole.cells[from[c]].place);
}

// A cut between cells copies no cell and doubles the nodes in its plane.
TEST(HexLattice, a_cut_along_the_faces_of_cells_parts_them) {
  const TetMesh mesh = bar();
  const Grid grid = grid_around(mesh, 0.005);
  const HexLattice lattice = lattice_of(cut_along(mesh, {across_at(0.02)}), grid);
  EXPECT_EQ(parts(lattice), 2u);
  EXPECT_EQ(lattice.cells.size(), 128u);
  EXPECT_EQ(lattice.nodes.size(), 9u * 25 + 25);
}

TEST(HexLattice, a_cut_that_ends_inside_opens_to_the_cell_that_it_ends_in) {
  const TetMesh mesh = bar();
  const Grid grid = grid_around(mesh, 0.005);
  const HexLattice lattice = lattice_of(cut_along(mesh, {across_at(0.0172, 0.0125)}), grid);
  EXPECT_EQ(parts(lattice), 1u);
  EXPECT_EQ(lattice.cells.size(), 128u + 8);
  EXPECT_EQ(lattice.nodes.size(), 9u * 25 + 2 * 2 * 5);
}

// Repeated cuts of one cell: divided material stays divided, and each copy knows the copy that it came from.
TEST(HexLattice, cuts_that_cross_divide_the_copies_of_copies) {
  const TetMesh mesh = bar();
  const Grid grid = grid_around(mesh, 0.005);
  const std::vector<Vec3> lengthwise{Vec3(-1, 0.0083, -1), Vec3(1, 0.0083, -1), Vec3(1, 0.0083, 1),
                                     Vec3(-1, 0.0083, 1)};
  const TetMesh once = cut_along(mesh, {across_at(0.0172)}), twice = cut_along(once, {lengthwise});
  const HexLattice before = lattice_of(once, grid), now = lattice_of(twice, grid);
  EXPECT_EQ(parts(now), 4u);
  EXPECT_NEAR(filled(now), 128, 1e-8);
  const std::vector<std::uint32_t> from = cells_before(now, before, once);
  std::vector<double> fill(before.cells.size(), 0);
  for (std::uint32_t c = 0; c < from.size(); ++c) fill[from[c]] += now.cells[c].fill;
  for (std::uint32_t c = 0; c < fill.size(); ++c) EXPECT_NEAR(fill[c], before.cells[c].fill, 1e-9);
}

// Two bodies in one cell are two copies from the start.
// The border is in the middle of the second layer of cells: the third node is the first that the tissue beyond moves.
TEST(HexLattice, fixed_tissue_ends_where_its_tetrahedra_do) {
  const TetMesh mesh = bar();
  const double border_m = 0.015, cell_m = 0.01;
  LatticeMaker maker(grid_around(mesh, cell_m));
  std::vector<std::uint32_t> all(mesh.tetrahedra.size());
  for (std::uint32_t t = 0; t < all.size(); ++t) all[t] = t;
  maker.look_at(all, mesh, TetStars(mesh), [&](VertexId v) { return mesh.vertices_body_m[v].x() < border_m + 1e-9; });
  const HexLattice lattice = maker.make(mesh);
  EXPECT_NEAR(filled(lattice), 0.025 * 0.02 * 0.02 / std::pow(cell_m, 3), 1e-9);
  for (const HexCell& cell : lattice.cells) {
    EXPECT_NEAR(cell.fill, cell.place[0] == 0 ? 0 : cell.place[0] == 1 ? 0.5 : 1, 1e-9);
    EXPECT_NEAR(cell.offset.x(), cell.place[0] == 1 ? 0.5 : 0, 1e-9);
  }
  double clamped = 0;
  for (const HexSkin& part : lattice.skin) {
    if (!part.fixed) continue;
    const auto& [a, b, c] = part.corners;
    for (const Vec3& x : part.corners) EXPECT_NEAR(x.x(), 1.5, 1e-9);
    clamped += 0.5 * (b - a).cross(c - a).norm();
  }
  EXPECT_NEAR(clamped, 4, 1e-9) << "all of the section";
}

TEST(HexLattice, pieces_that_do_not_touch_share_no_cell) {
  TetMesh mesh = bar(2);
  const auto n = static_cast<VertexId>(mesh.vertices_body_m.size());
  const TetMesh other = mesh;
  for (const Vec3& x : other.vertices_body_m) mesh.vertices_body_m.push_back(x + Vec3(0.0411, 0, 0));
  for (Tetrahedron t : other.tetrahedra) {
    for (VertexId& v : t) v += n;
    mesh.tetrahedra.push_back(t);
  }
  EXPECT_EQ(parts(lattice_of(mesh, grid_around(mesh, 0.007))), 2u);
}

}  // namespace
}  // namespace sectio::hexa_test

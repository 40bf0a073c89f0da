// The edges that may collapse, and the mesh afterwards: inside, on flat sides, along creases and lips.
#include "sim_server/volume/tets/collapse.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "sim_server/volume/tets/boundary_change.h"
#include "sim_server/volume/tets/tet_cut.h"
#include "tests/support/tet_shapes.h"

namespace sectio::tets_test {

void PrintTo(CollapseVerdict verdict, std::ostream* out) {
  *out << to_string(verdict);
}

namespace {

using enum CollapseVerdict;

// Vertices of a box of 2 x 2 x 2 cubes of 10 mm, by their places: 0 to 2 along each axis.
constexpr VertexId at(VertexId x, VertexId y, VertexId z) {
  return (x * 3 + y) * 3 + z;
}
constexpr VertexId kTop = at(1, 1, 2), kCorner = at(2, 2, 2), kInside = at(1, 1, 1);

TetMesh cubes() {
  return test::tet_box(2, 2, 2, Vec3::Constant(0.02), test::BoxLattice::kuhn);
}
// The box with a vertex at a twentieth of the edge from a to b.
struct Split {
  Split(const TetMesh& mesh, VertexId a, VertexId b) : volume(mesh), made(volume.split(a, b, 0.05)) { volume.forget(); }
  TetTopology volume;
  VertexId made;
};

void expect_same_shape(const TetTopology& volume, const TetMesh& before) {
  const TetReport report = check(volume.mesh());
  EXPECT_TRUE(report.valid) << report.first_defect;
  EXPECT_NEAR(report.volume_m3, check(before).volume_m3, 1e-15);
}

TEST(Collapse, edges_are_short_beside_those_around_them) {
  const Split top(cubes(), kTop, at(2, 1, 2));
  EXPECT_LT(edge_ratio(top.volume, top.made, kTop), 0.06);
  EXPECT_GT(edge_ratio(top.volume, top.made, at(2, 1, 2)), 0.7);
  EXPECT_EQ(collapse_onto(top.volume, top.made, 0.15), kTop);
  EXPECT_FALSE(collapse_onto(top.volume, top.made, 0.03));
}

TEST(Collapse, on_a_flat_side_either_end_goes) {
  for (const bool forwards : {true, false}) {
    Split top(cubes(), kTop, at(2, 1, 2));
    const VertexId v = forwards ? top.made : kTop, w = forwards ? kTop : top.made;
    ASSERT_EQ(judge_collapse(top.volume, v, w), fine);
    const TetChange planned = top.volume.collapse_change(v, w), done = top.volume.collapse(v, w);
    EXPECT_EQ(planned.tetrahedra.size(), done.tetrahedra.size());
    EXPECT_FALSE(top.volume.alive(v));
    expect_same_shape(top.volume, cubes());
    // The change of the surface agrees with the surface of all tetrahedra.
    TetMesh whole{top.volume.mesh()};
    EXPECT_EQ(whole.vertices_body_m.size(), cubes().vertices_body_m.size());
    EXPECT_EQ(surface_of(whole).soup.triangles.size(), surface_of(cubes()).soup.triangles.size());
  }
}

TEST(Collapse, what_the_surface_loses_and_gets_is_that_of_all_tetrahedra) {
  Split top(cubes(), kTop, at(2, 1, 2));
  const auto faces = [](const TetTopology& volume) {
    std::set<std::array<VertexId, 3>> result;
    for (std::uint32_t t = 0; t < volume.tetrahedra().size(); ++t)
      for (std::size_t c = 0; c < 4; ++c) {
        if (volume.tetrahedra()[t] == kNoTetrahedron || volume.across(t, c) != kNone) continue;
        std::array<VertexId, 3> key;
        for (std::size_t k = 0; k < 3; ++k) key[k] = volume.tetrahedra()[t][kTetFaces[c][k]];
        std::ranges::rotate(key, std::ranges::min_element(key));
        result.insert(key);
      }
    return result;
  };
  const auto turned = [](std::vector<std::array<VertexId, 3>> list) {
    for (auto& key : list) std::ranges::rotate(key, std::ranges::min_element(key));
    return std::set(list.begin(), list.end());
  };
  const auto before = faces(top.volume);
  const BoundaryChange change = boundary_change(top.volume.collapse(kTop, top.made).tetrahedra);
  const auto after = faces(top.volume);
  std::set<std::array<VertexId, 3>> lost, got;
  std::ranges::set_difference(before, after, std::inserter(lost, lost.end()));
  std::ranges::set_difference(after, before, std::inserter(got, got.end()));
  EXPECT_EQ(turned(change.removed), lost);
  EXPECT_EQ(turned(change.added), got);
  EXPECT_EQ(lost.size(), got.size() + 2);
}

TEST(Collapse, a_change_names_all_that_have_another_neighbour) {
  for (const VertexId inside : {kInside, at(2, 1, 2)}) {
    Split from(cubes(), kTop, inside);
    const auto neighbours = [&](std::uint32_t t) {
      std::array<std::uint32_t, 4> result{};
      for (std::size_t c = 0; c < 4; ++c) result[c] = from.volume.across(t, c);
      return result;
    };
    std::vector<std::array<std::uint32_t, 4>> before;
    for (std::uint32_t t = 0; t < from.volume.tetrahedra().size(); ++t) before.push_back(neighbours(t));
    const TetChange change = from.volume.collapse(from.made, kTop);
    for (std::uint32_t t = 0; t < before.size(); ++t) {
      const bool named = std::ranges::binary_search(change.tetrahedra, t, {}, &TetEdit::id);
      EXPECT_TRUE(named || neighbours(t) == before[t]) << t;
    }
  }
}

TEST(Collapse, along_a_crease_and_not_off_it) {
  Split edge(cubes(), at(1, 2, 2), kCorner);
  EXPECT_EQ(judge_collapse(edge.volume, edge.made, at(1, 2, 2)), fine);
  EXPECT_EQ(judge_collapse(edge.volume, at(1, 2, 2), edge.made), fine);
  for (const VertexId off : {kTop, at(1, 2, 1)}) EXPECT_EQ(judge_collapse(edge.volume, at(1, 2, 2), off), sideways);
  edge.volume.collapse(edge.made, at(1, 2, 2));
  expect_same_shape(edge.volume, cubes());
}

TEST(Collapse, a_corner_never) {
  const Split edge(cubes(), kCorner, at(1, 2, 2));
  EXPECT_EQ(judge_collapse(edge.volume, kCorner, edge.made), corner);
  EXPECT_EQ(judge_collapse(edge.volume, edge.made, kCorner), fine);
}

TEST(Collapse, a_crease_that_bends_is_a_corner) {
  for (const double off_m : {0.0001, 0.002}) {
    TetMesh bent = cubes();
    bent.vertices_body_m[at(1, 2, 2)].y() += off_m;
    const CollapseVerdict verdict = judge_collapse(TetTopology(bent), at(1, 2, 2), at(0, 2, 2));
    EXPECT_EQ(verdict == corner, off_m > 0.001) << to_string(verdict);
  }
}

TEST(Collapse, from_inside_onto_the_surface_and_not_from_there) {
  Split depth(cubes(), kTop, kInside);
  EXPECT_EQ(judge_collapse(depth.volume, kTop, depth.made), inward);
  ASSERT_EQ(judge_collapse(depth.volume, depth.made, kTop), fine);
  depth.volume.collapse(depth.made, kTop);
  expect_same_shape(depth.volume, cubes());
}

TEST(Collapse, a_hill_stays_and_what_splits_its_edges_goes) {
  TetMesh hill = cubes();
  hill.vertices_body_m[kTop].z() += 0.004;
  const Split slope(hill, kTop, at(2, 1, 2));
  EXPECT_EQ(judge_collapse(TetTopology(hill), kTop, at(2, 1, 2)), bent);
  EXPECT_EQ(judge_collapse(slope.volume, slope.made, kTop), fine);
}

// Each displacement is within the tolerance, but their sum exceeds that of the volume.
TEST(Collapse, a_flat_hill_stays_for_its_volume) {
  for (const double high_m : {0.0, 0.00015}) {
    TetMesh hill = cubes();
    hill.vertices_body_m[kTop].z() += high_m;
    const TetTopology volume(hill);
    EXPECT_EQ(judge_collapse(volume, kTop, at(2, 1, 2)), high_m > 0 ? bent : flat);
  }
}

// Triangles beyond x have another label: vertices on the lip stay on it, and those at its end don't move.
TEST(Collapse, on_a_lip_only_along_it) {
  Split lip(cubes(), kTop, at(1, 2, 2));
  const auto by_x = [&](const std::array<VertexId, 3>& corners) {
    double x = 0;
    for (const VertexId v : corners) x += lip.volume.vertex(v).rest_body_m.x() / 3;
    return x > 0.01 ? 1 : 0;
  };
  EXPECT_EQ(judge_collapse(lip.volume, kTop, lip.made, by_x), fine);
  EXPECT_EQ(judge_collapse(lip.volume, lip.made, kTop, by_x), fine);
  EXPECT_EQ(judge_collapse(lip.volume, lip.made, at(2, 2, 2), by_x), sideways);
  EXPECT_EQ(judge_collapse(lip.volume, at(1, 2, 2), lip.made, by_x), corner) << "where the lip meets a crease";
}

TEST(Collapse, two_sides_of_a_thin_body_are_not_joined) {
  const TetTopology sheet(test::tet_box(2, 2, 1, Vec3(0.02, 0.02, 0.001), test::BoxLattice::kuhn));
  const VertexId below = (1 * 3 + 1) * 2, above = below + 1;
  ASSERT_LT(edge_ratio(sheet, above, below), 0.15);
  EXPECT_EQ(judge_collapse(sheet, above, below), torn);
  EXPECT_EQ(judge_collapse(sheet, below, above), torn);
}

TEST(Collapse, no_tetrahedron_turns_over_in_the_world) {
  Split top(cubes(), kTop, at(2, 1, 2));
  ASSERT_EQ(judge_collapse(top.volume, kTop, top.made), fine);
  top.volume.set_state(top.made, Vec3(0.01, 0.01, -0.05), Vec3::Zero());
  EXPECT_EQ(judge_collapse(top.volume, kTop, top.made), flat);
}

TEST(Collapse, nothing_gets_worse) {
  const TetTopology volume(cubes());
  EXPECT_EQ(judge_collapse(volume, kTop, at(2, 1, 2)), flat);
}

// A cut that ends inside: judges every edge in both directions. A fine collapse leaves a valid mesh; some of those that
// are judged torn don't.
TEST(Collapse, C_LIM_1_every_edge_of_a_cut_block_that_may_go_leaves_the_block) {
  TetMesh mesh = test::tet_box(3, 3, 3, Vec3::Constant(0.03));
  test::jitter(mesh, 0.001);
  TetTopology volume(mesh);
  cut(volume, {{{-0.01, 0.0143, 0.011}, {0.021, 0.0143, 0.011}, {0.021, 0.0156, 0.04}, {-0.01, 0.0156, 0.04}}}, {});
  cut(volume, {{{0.0133, 0.004, 0.012}, {0.0133, 0.04, 0.012}, {0.0139, 0.04, 0.04}, {0.0139, 0.004, 0.04}}}, {});
  volume.forget();
  const TetReport before = check(volume.mesh());
  ASSERT_TRUE(before.conforming);
  const std::size_t sides = surface_of(volume.mesh()).soup.triangles.size();
  std::map<CollapseVerdict, int> count;
  int broken = 0;
  for (VertexId v = 0; v < volume.vertex_count(); ++v) {
    std::set<VertexId> around;
    for (const std::uint32_t t : volume.star(v))
      around.insert(volume.tetrahedra()[t].begin(), volume.tetrahedra()[t].end());
    around.erase(v);
    for (const VertexId w : around) {
      const CollapseVerdict verdict = judge_collapse(volume, v, w);
      ++count[verdict];
      if (verdict != fine && verdict != torn) continue;
      TetTopology copy = volume;
      copy.collapse(v, w);
      const TetReport after = check(copy.mesh());
      broken += verdict == torn && (!after.conforming || after.components != before.components);
      if (verdict != fine) continue;
      ASSERT_TRUE(after.conforming) << v << " onto " << w << ": " << after.first_defect;
      ASSERT_EQ(after.components, before.components);
      ASSERT_NEAR(after.volume_m3, before.volume_m3, kCollapseVolume * 1e-6);
      const std::size_t left = surface_of(copy.mesh()).soup.triangles.size();
      ASSERT_TRUE(left == sides || left + 2 == sides) << "no cut is closed";
    }
  }
  for (const CollapseVerdict verdict : {fine, torn, inward, corner, sideways, bent, flat})
    EXPECT_GT(count[verdict], 5) << to_string(verdict);
  EXPECT_GT(broken, 5);
}

}  // namespace
}  // namespace sectio::tets_test

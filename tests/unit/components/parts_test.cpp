#include "sim_server/components/parts.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "common/mesh/check.h"
#include "sim_server/components/leave.h"
#include "tests/support/shapes.h"

namespace sectio::test {
namespace {

// Several closed surfaces as one mesh.
TriangleMesh together(const std::vector<TriangleSoup>& soups) {
  TriangleSoup all;
  for (const TriangleSoup& soup : soups) all = joined(std::move(all), soup);
  return TriangleMesh(all);
}

TriangleId last_of(const TriangleMesh& mesh) {
  return mesh.triangle_slots() - 1;
}

TEST(Parts, nothing_came_off_when_the_changed_triangles_touch) {
  const TriangleMesh mesh(ellipsoid(5, Vec3::Ones()));
  const auto& ring = mesh.neighbours(77);
  const std::vector<TriangleId> changed{ring[0], ring[1], ring[2], 77};
  const PartSearch search = separated_parts(mesh, changed);
  EXPECT_TRUE(search.parts.empty());
  EXPECT_EQ(search.visited, 4u) << "only what changed, of " << mesh.triangle_count();
}

TEST(Parts, searches_that_meet_see_no_more_than_the_way_between) {
  const TriangleMesh mesh(ellipsoid(6, Vec3::Ones()));
  const PartSearch search = separated_parts(mesh, std::vector<TriangleId>{0, 60});
  EXPECT_TRUE(search.parts.empty());
  EXPECT_LT(search.visited, 300u) << "of " << mesh.triangle_count();
}

TEST(Parts, what_came_off_is_found_in_time_of_its_own_size_whatever_the_rest) {
  std::uint64_t visited[2];
  for (const int levels : {4, 6}) {
    const TriangleMesh mesh =
        together({ellipsoid(levels, Vec3::Ones()), moved(ellipsoid(2, Vec3::Ones()), Vec3(3, 0, 0))});
    const std::uint32_t part = 320;
    const PartSearch search = separated_parts(mesh, std::vector<TriangleId>{5, last_of(mesh)});
    ASSERT_EQ(search.parts.size(), 1u);
    EXPECT_EQ(search.parts[0].triangles.size(), part);
    EXPECT_EQ(search.parts[0].vertices.size(), 162u);
    EXPECT_EQ(search.parts[0].triangles.back(), last_of(mesh));
    EXPECT_LT(search.rest, mesh.triangle_count() - part);
    EXPECT_LT(search.visited, 3 * part + 10);
    visited[levels / 6] = search.visited;
  }
  EXPECT_EQ(visited[0], visited[1]) << "sixteen times the rest, the same work";
}

TEST(Parts, the_larger_side_is_the_rest_whichever_seed_comes_first) {
  const TriangleMesh mesh = together({ellipsoid(2, Vec3::Ones()), moved(ellipsoid(4, Vec3::Ones()), Vec3(3, 0, 0))});
  const PartSearch search = separated_parts(mesh, std::vector<TriangleId>{last_of(mesh), 0});
  ASSERT_EQ(search.parts.size(), 1u);
  EXPECT_EQ(search.parts[0].triangles.size(), 320u);
  EXPECT_EQ(search.parts[0].triangles.front(), 0u);
}

TEST(Parts, several_at_once) {
  const TriangleMesh mesh =
      together({moved(box(1, 1, 1, Vec3::Ones()), Vec3(5, 0, 0)), ellipsoid(4, Vec3::Ones()),
                moved(ellipsoid(2, Vec3::Ones()), Vec3(0, 9, 0)), moved(box(2, 2, 2, Vec3::Ones()), Vec3(0, 0, 7))});
  std::vector<TriangleId> all(mesh.triangle_slots());
  for (TriangleId t = 0; t < all.size(); ++t) all[t] = t;
  for (const std::vector<TriangleId>& changed : {all, std::vector<TriangleId>{0, 11, 12, 20, 5200, last_of(mesh)}}) {
    std::vector<std::size_t> sizes;
    for (const Part& part : separated_parts(mesh, changed).parts) sizes.push_back(part.triangles.size());
    std::sort(sizes.begin(), sizes.end());
    EXPECT_EQ(sizes, (std::vector<std::size_t>{12, 48, 320})) << "all but the largest";
  }
}

TEST(Parts, dead_and_missing_slots_are_skipped) {
  const TriangleMesh mesh(ellipsoid(1, Vec3::Ones()));
  EXPECT_TRUE(separated_parts(mesh, std::vector<TriangleId>{100000}).parts.empty());
  EXPECT_TRUE(separated_parts(mesh, {}).parts.empty());
}

TEST(Leave, part_and_rest_are_what_the_body_was) {
  TriangleMesh mesh = together({ellipsoid(3, Vec3::Ones()), moved(ellipsoid(2, Vec3(1, 2, 0.5)), Vec3(3, 0, 0)),
                                moved(box(2, 2, 2, Vec3::Ones()), Vec3(0, 0, 7))});
  const double volume = check(mesh).volume_m3;
  const PartSearch search = separated_parts(mesh, std::vector<TriangleId>{0, 1400});
  ASSERT_EQ(search.parts.size(), 1u);
  const Leaving leaving = leave(mesh, search.parts[0]);
  const TriangleMesh before = mesh;
  ASSERT_EQ(apply(leaving.delta, mesh), ApplyStatus::applied);

  const SurfaceReport rest = check(mesh), part = check(leaving.mesh);
  EXPECT_TRUE(rest.valid()) << rest.first_defect;
  EXPECT_TRUE(part.valid()) << part.first_defect;
  EXPECT_EQ(part.components, 1u);
  EXPECT_EQ(rest.components, 2u);
  EXPECT_EQ(part.triangles, 320u);
  EXPECT_NEAR(rest.volume_m3 + part.volume_m3, volume, 1e-12 * volume);
  EXPECT_EQ(leaving.mesh.revision(), 0u);
  EXPECT_EQ(mesh.revision(), before.revision() + 1);
  EXPECT_EQ(leaving.mesh.free_vertices().size(), 0u);
  for (VertexId v = 0; v < leaving.mesh.vertex_slots(); ++v)
    EXPECT_EQ(leaving.mesh.rest_body_m(v), before.rest_body_m(leaving.vertex_from[v]));

  TriangleMesh back = mesh;
  ASSERT_EQ(apply(inverse(leaving.delta, before), back), ApplyStatus::applied);
  EXPECT_TRUE(back.same_database(before)) << "and can be undone";
}

TEST(Leave, a_piece_of_a_component_is_no_part) {
  TriangleMesh mesh(ellipsoid(2, Vec3::Ones()));
  Part part = part_at(mesh, 0);
  EXPECT_EQ(part.triangles.size(), mesh.triangle_count());
  // A delta that takes only some of the triangles leaves a hole, which apply() refuses.
  TopologyDelta delta = leave(mesh, part).delta;
  delta.triangles.pop_back();
  delta.hash_after += triangle_hash(mesh.triangle_slots() - 1, mesh.triangle(mesh.triangle_slots() - 1));
  EXPECT_EQ(apply(delta, mesh), ApplyStatus::malformed);
}

}  // namespace
}  // namespace sectio::test

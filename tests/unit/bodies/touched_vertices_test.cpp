#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "common/math/positions_view.h"
#include "sim_server/bodies/particle_state.h"
#include "sim_server/bodies/touched_vertices.h"

namespace sectio::bodies_test {
namespace {

TriangleSoup tetrahedron() {
  TriangleSoup soup;
  soup.vertices_body_m = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  soup.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
  return soup;
}

TEST(ParticleState, starts_at_rest_at_the_pose) {
  Pose pose;
  pose.position_m = Vec3(1, 2, 3);
  const TriangleSoup soup = tetrahedron();
  const ParticleState state = particles_at_rest(soup.vertices_body_m, pose);
  ASSERT_EQ(state.size(), 4u);
  EXPECT_EQ(state.position_world_m[1], Vec4f(2, 2, 3, 0));
  EXPECT_EQ(state.velocity_world_m_per_s[1], Vec4f::Zero());
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(state.position_world_m.data()) % 16, 0u);
}

TEST(ParticleState, keeps_what_it_has_when_it_grows) {
  ParticleState state;
  state.resize(1);
  state.place(0, Vec3(1, 2, 3), Vec3(4, 5, 6));
  state.resize(100);
  EXPECT_EQ(state.position_world_m[0], Vec4f(1, 2, 3, 0));
  EXPECT_EQ(state.velocity_world_m_per_s[0], Vec4f(4, 5, 6, 0));
  EXPECT_EQ(state.position_world_m[99], Vec4f::Zero());
}

TEST(PositionsView, sees_the_state_itself) {
  ParticleState state = particles_at_rest(tetrahedron().vertices_body_m, {});
  const PositionsView positions = state.position_world_m;
  state.place(3, Vec3(0, 0, 2));
  ASSERT_EQ(positions.size(), 4u);
  EXPECT_EQ(positions[3], Vec3f(0, 0, 2));
  const std::vector<Vec3f> triples(positions.begin(), positions.end());
  const PositionsView same = triples;
  EXPECT_TRUE(std::equal(positions.begin(), positions.end(), same.begin(), same.end()));
  EXPECT_EQ(PositionsView(std::vector<Vec3f>{}).size(), 0u);
}

TEST(TouchedVertices, are_the_corners_before_and_after) {
  const TriangleMesh mesh(tetrahedron());
  TopologyDelta delta;  // puts vertex 4 into triangle 2 (corners 1, 2, 3)
  delta.vertices = {{4, true, Vec3(0.3, 0.3, 0.3)}};
  delta.triangles = {{2, {{1, 2, 4}, Surface::skin}}, {4, {{2, 3, 4}, Surface::skin}}, {5, {{3, 1, 4}, Surface::skin}}};
  EXPECT_EQ(touched_vertices(delta, mesh), (std::vector<VertexId>{1, 2, 3, 4}));
  TopologyDelta death;  // removing a triangle touches its corners
  death.triangles = {{1, {}}};
  EXPECT_EQ(touched_vertices(death, mesh), (std::vector<VertexId>{0, 1, 3}));
  EXPECT_TRUE(touched_vertices({}, mesh).empty());
}

}  // namespace
}  // namespace sectio::bodies_test

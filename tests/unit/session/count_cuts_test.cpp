// How many cuts a report counts.
#include "sim_server/session/count_cuts.h"

#include <gtest/gtest.h>

#include "common/mesh/check.h"

#include "tests/support/loop_cut.h"

namespace sectio::session_test {
namespace {

std::size_t cuts_of(const test::Operation& op) {
  std::vector<CutSurface> surfaces;
  for (std::uint32_t b = 0; b < op.simulation.body_count(); ++b)
    surfaces.push_back({&op.mesh(b), op.simulation.body(b).pose, 0});
  return count_cuts(surfaces);
}

// Two walls of a body: squares of half a centimetre at these places, which face each other, closed by skin behind.
TriangleMesh walls_at(double left_m, double right_m) {
  TriangleSoup soup;
  for (const bool right : {false, true}) {
    const double x_m = right ? right_m : left_m;
    const auto first = static_cast<VertexId>(soup.vertices_body_m.size());
    for (const Vec3& corner : {Vec3(0, 0, 0), Vec3(0, 0.005, 0), Vec3(0, 0, 0.005)})
      soup.vertices_body_m.push_back(Vec3(x_m, 0, 0) + corner);
    soup.vertices_body_m.push_back(Vec3(x_m + (right ? 0.005 : -0.005), 0, 0));
    const auto add = [&](VertexId a, VertexId b, VertexId c) {
      if (right) std::swap(b, c);
      soup.triangles.push_back({first + a, first + b, first + c});
    };
    add(0, 1, 2);
    add(0, 2, 3);
    add(0, 3, 1);
    add(1, 3, 2);
  }
  const TriangleMesh all_skin(soup);
  std::vector<Triangle> triangles(all_skin.triangles().begin(), all_skin.triangles().end());
  triangles[0].surface = triangles[4].surface = Surface::wall;
  const std::vector<Vec3> rest(all_skin.rest_body_m().begin(), all_skin.rest_body_m().end());
  return TriangleMesh(rest, std::vector<std::uint8_t>(rest.size(), 1), triangles, 0);
}

TEST(CountCuts, walls_that_face_each_other_at_rest_are_one_cut_and_others_are_not) {
  for (const auto& [apart_m, cuts] : std::vector<std::pair<double, std::size_t>>{{0, 1}, {0.0008, 1}, {0.0015, 2}}) {
    const TriangleMesh mesh = walls_at(0, apart_m);
    ASSERT_TRUE(check(mesh).valid()) << check(mesh).first_defect;
    EXPECT_EQ(count_cuts(std::vector<CutSurface>{{&mesh, {}, 0, 0.0006}}), cuts) << apart_m;
  }
}

TEST(CountCuts, bodies_that_came_of_different_ones_share_no_cut) {
  const TriangleMesh mesh = walls_at(0, 0);
  EXPECT_EQ(count_cuts(std::vector<CutSurface>{{&mesh, {}, 0}, {&mesh, {}, 0}}), 1u);
  EXPECT_EQ(count_cuts(std::vector<CutSurface>{{&mesh, {}, 0}, {&mesh, {}, 1}}), 2u);
  const Pose aside{Vec3(0.1, 0, 0), Eigen::Quaterniond::Identity()};
  EXPECT_EQ(count_cuts(std::vector<CutSurface>{{&mesh, {}, 0}, {&mesh, aside, 0}}), 2u);
}

TEST(CountCuts, a_loop_that_frees_a_piece_is_one_cut_wherever_the_piece_is) {
  for (const FreeParts fate : {FreeParts::keep, FreeParts::rigid, FreeParts::deformable}) {
    test::Operation op(test::loop_scene(fate));
    EXPECT_EQ(cuts_of(op), 0u);
    test::cut_arc(op, 0, 100);
    EXPECT_EQ(cuts_of(op), 1u);
    test::cut_on(op, 100, 375);
    test::lift(op);
    op.rest(200);
    EXPECT_EQ(cuts_of(op), 1u);
    op.tip_to(-0.035, -0.01, -0.004);
    op.tip_to(-0.035, -0.01, test::kStrokeDepth_m);
    op.tip_to(-0.025, -0.01, test::kStrokeDepth_m);
    EXPECT_EQ(cuts_of(op), 2u);
  }
}

}  // namespace
}  // namespace sectio::session_test

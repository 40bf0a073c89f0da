#include "render_client/replica/tip_depth.h"

#include <gtest/gtest.h>

#include "tests/support/shapes.h"

namespace sectio::replica_test {
namespace {

Frame frame_with_tip_at(const Vec3& tip_world_m) {
  const TriangleMesh mesh(test::ellipsoid(3, Vec3(0.1, 0.1, 0.1)));
  Frame frame;
  BodyFrame body;
  for (const Vec3& p : mesh.rest_body_m()) body.positions_world_m.push_back(p.cast<float>());
  body.rest_body_m = body.positions_world_m;
  body.triangles.assign(mesh.triangles().begin(), mesh.triangles().end());
  frame.bodies.push_back(body);
  ToolFrame tool;
  tool.present = true;
  tool.pose_world.position_m = tip_world_m;
  tool.abcd_tool_m.fill(Vec3::Zero());
  frame.tools.push_back(tool);
  return frame;
}

TEST(TipDepth, is_the_distance_to_the_skin_from_inside_and_nothing_outside) {
  EXPECT_NEAR(visible_tip_depth_m(frame_with_tip_at(Vec3(0.09, 0, 0))), 0.01, 0.001);
  EXPECT_NEAR(visible_tip_depth_m(frame_with_tip_at(Vec3(0, 0, -0.05))), 0.05, 0.001);
  EXPECT_EQ(visible_tip_depth_m(frame_with_tip_at(Vec3(0.11, 0, 0))), 0);
  EXPECT_EQ(visible_tip_depth_m(frame_with_tip_at(Vec3(0.09, 0.09, 0))), 0);  // within the box, beside the body
}

TEST(TipDepth, a_tool_in_a_cut_or_absent_is_not_inside) {
  Frame frame = frame_with_tip_at(Vec3(0.09, 0, 0));
  frame.tools[0].present = false;
  EXPECT_EQ(visible_tip_depth_m(frame), 0);
  frame = frame_with_tip_at(Vec3(0.09, 0, 0));
  for (Triangle& triangle : frame.bodies[0].triangles) triangle.surface = Surface::wall;
  EXPECT_EQ(visible_tip_depth_m(frame), 0);
}

}  // namespace
}  // namespace sectio::replica_test

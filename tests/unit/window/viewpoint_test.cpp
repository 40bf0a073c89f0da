#include "render_client/window/viewpoint.h"

#include <gtest/gtest.h>

namespace sectio::window_test {
namespace {

Frame frame_with_tool_at(const Vec3& place_world_m) {
  Frame frame;
  frame.camera = {Vec3(0, -0.3, 0.2), Vec3::Zero(), Vec3::UnitZ(), 40};
  frame.tools.emplace_back().present = true;
  frame.tools[0].pose_world.position_m = place_world_m;
  return frame;
}
Camera seen(Viewpoint& view, Frame frame) {
  view.look(frame);
  return frame.camera;
}

TEST(Viewpoint, begins_with_the_scenes_view_and_finds_back_to_it) {
  Viewpoint view;
  const Frame frame = frame_with_tool_at(Vec3::Zero());
  EXPECT_EQ(seen(view, frame).eye_world_m, frame.camera.eye_world_m);
  view.apply({.turn_right_rad = 0.5, .nearer = 0.5});
  const Vec3 eye = seen(view, frame).eye_world_m;
  EXPECT_NEAR(eye.norm(), 0.5 * frame.camera.eye_world_m.norm(), 1e-9);
  EXPECT_GT((eye.normalized() - frame.camera.eye_world_m.normalized()).norm(), 0.1);
  view.apply({.home = true});
  EXPECT_EQ(seen(view, frame).eye_world_m, frame.camera.eye_world_m);
}

TEST(Viewpoint, a_section_faces_the_person_who_asks_for_it_and_stays) {
  Viewpoint view;
  const Frame frame = frame_with_tool_at(Vec3::Zero());
  seen(view, frame);
  EXPECT_FALSE(view.section());
  view.apply({.section = true});
  ASSERT_TRUE(view.section());
  EXPECT_LT((view.section()->normal_world - frame.camera.eye_world_m.normalized()).norm(), 1e-12);
  EXPECT_EQ(view.section()->point_world_m, frame.camera.target_world_m);
  view.apply({.turn_right_rad = 0.5, .section_nearer_m = 0.01});
  EXPECT_LT((view.section()->point_world_m - 0.01 * frame.camera.eye_world_m.normalized()).norm(), 1e-12);
  view.apply({.section = true});
  EXPECT_FALSE(view.section());
}

TEST(Viewpoint, moves_with_the_instrument_that_it_follows_until_it_is_told_again) {
  Viewpoint view;
  seen(view, frame_with_tool_at(Vec3::Zero()));
  view.apply({.follows = 0});
  const Camera before = seen(view, frame_with_tool_at(Vec3::Zero()));
  const Camera after = seen(view, frame_with_tool_at(Vec3(0.01, 0.02, 0)));
  EXPECT_NEAR((after.eye_world_m - before.eye_world_m - Vec3(0.01, 0.02, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR((after.target_world_m - before.target_world_m - Vec3(0.01, 0.02, 0)).norm(), 0, 1e-12);
  view.apply({.follows = 0});
  EXPECT_EQ(seen(view, frame_with_tool_at(Vec3(0.1, 0, 0))).eye_world_m, after.eye_world_m);
  view.apply({.follows = 7});
  EXPECT_EQ(seen(view, frame_with_tool_at(Vec3(0.2, 0, 0))).eye_world_m, after.eye_world_m) << "there is none";
}

TEST(Viewpoint, a_section_tells_its_depth_and_can_be_there_from_the_beginning) {
  Viewpoint view({.section = true});
  seen(view, frame_with_tool_at(Vec3::Zero()));
  ASSERT_TRUE(view.section());
  view.apply({.section_nearer_m = -0.01});
  EXPECT_NEAR(view.section_depth_m(), 0.01, 1e-12);
  view.apply({.section = true});
  view.apply({.section = true});
  EXPECT_EQ(view.section_depth_m(), 0) << "a new one is in the middle";
}

TEST(Viewpoint, goes_through_the_fields_that_bodies_publish_and_back_to_tissue) {
  Viewpoint view;
  Frame frame = frame_with_tool_at(Vec3::Zero());
  frame.bodies.resize(2);
  frame.bodies[0].scalars = {{"wetness", 0, 1, {}}, {"damage", 0, 1, {}}};
  frame.bodies[1].scalars = {{"wetness", 0, 1, {}}};
  seen(view, frame);
  EXPECT_EQ(view.fields(), (std::vector<std::string>{"damage", "wetness"}));
  for (const char* name : {"damage", "wetness", "", "damage"}) {
    view.apply({.next_field = true});
    EXPECT_EQ(view.options().field, name);
  }
  view.apply({.field = "wetness"});
  EXPECT_EQ(view.options().field, "wetness");
}

TEST(Viewpoint, two_presses_of_a_key_are_none_and_moves_add_up) {
  WindowInput input{.nearer = 2, .wireframe = true};
  input.add({.nearer = 3, .wireframe = true, .stereo = true, .follows = 1});
  EXPECT_FALSE(input.wireframe);
  EXPECT_TRUE(input.stereo);
  EXPECT_EQ(input.nearer, 6);
  EXPECT_EQ(input.follows, 1u);
}

TEST(Viewpoint, halts_and_goes_on) {
  Viewpoint view;
  EXPECT_FALSE(view.halted());
  view.apply({.halts = true});
  view.apply({});
  EXPECT_TRUE(view.halted());
  view.apply({.halts = true});
  EXPECT_FALSE(view.halted());
}

}  // namespace
}  // namespace sectio::window_test

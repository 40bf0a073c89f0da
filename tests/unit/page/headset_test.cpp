#include "render_client/page/headset.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace sectio::page_test {
namespace {

// Looks along the world's x axis, from above; its picture shows 0.1 m of what is around the target.
const Vec3 kTarget_m(0.2, 0.1, 0.03);
const Camera kAbove{kTarget_m + Vec3(-0.3, 0, 0.3), kTarget_m, Vec3::UnitZ(),
                    2 * std::atan(0.05 / (0.3 * std::numbers::sqrt2)) * 180 / std::numbers::pi};
constexpr double kScale = Headset::kSeen_m / 0.1;
const Vec3 kBody_room_m(0, -0.3, -0.5);

struct HeadsetTest : testing::Test {
  Headset headset{kAbove};

  // The tip ahead of a hand that points away from the person, at a place of the room.
  JointPose reach(const Vec3& tip_room_m, double closed = 0, bool carries = false) {
    headset.lead({Pose{tip_room_m + Vec3(0, 0, Headset::kReach_m)}, closed, carries});
    return *headset.wish();
  }
};

TEST_F(HeadsetTest, the_body_stands_before_the_person_and_a_hand_reaches_it) {
  EXPECT_TRUE(reach(kBody_room_m).position_m.isApprox(kTarget_m, 1e-9));
  const Vec3 right_room(0.1, 0, 0), up_room(0, 0.1, 0), ahead_room(0, 0, -0.1);
  const auto moved_m = [&](const Vec3& way) { return Vec3(reach(kBody_room_m + way).position_m - kTarget_m); };
  EXPECT_TRUE(moved_m(ahead_room).isApprox(Vec3(0.1 / kScale, 0, 0), 1e-6));
  EXPECT_TRUE(moved_m(up_room).isApprox(Vec3(0, 0, 0.1 / kScale), 1e-6));
  EXPECT_TRUE(moved_m(right_room).isApprox(Vec3(0, -0.1 / kScale, 0), 1e-6));
}

TEST_F(HeadsetTest, an_instrument_points_as_the_hand_does_its_edge_beneath) {
  const JointPose wish = reach(kBody_room_m, 0.5);
  EXPECT_TRUE((wish.orientation * Vec3::UnitZ()).isApprox(-Vec3::UnitX(), 1e-9)) << "the tip is away";
  EXPECT_TRUE((wish.orientation * Vec3::UnitX()).isApprox(-Vec3::UnitZ(), 1e-9));
  EXPECT_NEAR(wish.opening_rad, 0.5 * Headset::kWidest_rad, 1e-12);
}

TEST_F(HeadsetTest, a_hand_that_carries_the_scene_leaves_the_instrument_where_it_is_in_it) {
  const Vec3 before_m = reach(kBody_room_m).position_m;
  reach(kBody_room_m, 0, true);
  const Vec3 there_room_m = kBody_room_m + Vec3(0.2, 0.1, 0);
  EXPECT_EQ(reach(there_room_m, 0, true).position_m, before_m);
  EXPECT_TRUE(reach(there_room_m).position_m.isApprox(before_m, 1e-9));
}

// An eye 3 cm to the right of the origin: what is at a place of the room is drawn where the room's matrices put it.
TEST_F(HeadsetTest, eyes_see_the_scene_where_it_stands_in_the_room) {
  Eigen::Matrix4f eye_from_room = Eigen::Matrix4f::Identity(), projection = Eigen::Matrix4f::Zero();
  eye_from_room(0, 3) = -0.03f;
  projection(0, 0) = projection(1, 1) = 1;
  projection(2, 2) = -1.01f;
  projection(2, 3) = -0.1f;
  projection(3, 2) = -1;
  const EyeView eye = headset.eye(eye_from_room, projection);
  for (const Vec3& way_room_m : {Vec3(0, 0, 0), Vec3(0.1, -0.05, 0.2)}) {
    const Vec3 at_room_m = kBody_room_m + way_room_m, at_world_m = reach(at_room_m).position_m;
    const Vec4f wanted = projection * eye_from_room * at_room_m.cast<float>().homogeneous();
    const Vec4f seen = eye.projection * eye.view_from_world * at_world_m.cast<float>().homogeneous();
    EXPECT_TRUE(seen.hnormalized().isApprox(wanted.hnormalized(), 1e-4f));
  }
  const Eigen::Matrix3f turn = eye.view_from_world.topLeftCorner<3, 3>();
  EXPECT_TRUE((turn * turn.transpose()).isIdentity(1e-5f)) << "lamps are rigid to the eye";
}

}  // namespace
}  // namespace sectio::page_test

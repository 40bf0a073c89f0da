#include "render_client/page/mouse_hand.h"

#include <gtest/gtest.h>

#include <cmath>

namespace sectio::page_test {
namespace {

// A half ball of skin of 10 cm that looks like a lattice of triangles from above.
Frame ball(double radius_m) {
  Frame frame;
  BodyFrame& body = frame.bodies.emplace_back();
  constexpr int kSide = 60;
  for (int j = 0; j <= kSide; ++j)
    for (int i = 0; i <= kSide; ++i) {
      const double x = 0.16 * i / kSide - 0.08, y = 0.16 * j / kSide - 0.08;
      const double z = std::sqrt(std::max(0.0, radius_m * radius_m - x * x - y * y));
      body.positions_world_m.push_back(Vec3(x, y, z).cast<float>());
    }
  for (std::uint32_t j = 0; j < kSide; ++j)
    for (std::uint32_t i = 0; i < kSide; ++i) {
      const std::uint32_t a = j * (kSide + 1) + i, b = a + 1, c = a + kSide + 1, d = c + 1;
      body.triangles.push_back({{a, b, d}, Surface::skin});
      body.triangles.push_back({{a, d, c}, Surface::skin});
    }
  return frame;
}

// A rod of 1 cm along x that is seen from above.
Frame rod() {
  Frame frame;
  BodyFrame& body = frame.bodies.emplace_back();
  constexpr std::uint32_t kAround = 24, kAlong = 60;
  for (std::uint32_t j = 0; j < kAlong; ++j)
    for (std::uint32_t i = 0; i < kAround; ++i) {
      const double turn = 2 * M_PI * i / kAround;
      body.positions_world_m.push_back(
          Vec3(0.001 * j - 0.03, 0.005 * std::cos(turn), 0.005 * std::sin(turn)).cast<float>());
    }
  for (std::uint32_t j = 0; j + 1 < kAlong; ++j)
    for (std::uint32_t i = 0; i < kAround; ++i) {
      const std::uint32_t a = j * kAround + i, b = j * kAround + (i + 1) % kAround;
      body.triangles.push_back({{a, a + kAround, b}, Surface::skin});
      body.triangles.push_back({{b, a + kAround, b + kAround}, Surface::skin});
    }
  return frame;
}

constexpr double kRadius_m = 0.1;

Ray down_at(double x, double y) {
  return {Vec3(x, y, 0.3), -Vec3::UnitZ()};
}

struct Mouse : testing::Test {
  MouseHand hand;
  Frame frame = ball(kRadius_m);
  double now_s = 0;

  void move(double x, double y, bool pressed, bool closes = false) {
    hand.point({down_at(x, y), pressed, closes}, frame, Vec3::UnitX());
    hand.tick(now_s += 0.016);
  }
  void wait(double time_s) {
    for (double t = 0; t < time_s; t += 0.016) hand.tick(now_s += 0.016);
  }
  double height_m() const { return hand.wish()->position_m.norm() - kRadius_m; }
};

TEST_F(Mouse, wishes_nothing_before_it_has_been_over_tissue) {
  hand.point({down_at(0.2, 0.2), false, false}, frame, Vec3::UnitX());
  EXPECT_FALSE(hand.wish());
}

TEST_F(Mouse, hovers_and_goes_into_the_tissue_while_the_button_is_down) {
  move(0.02, 0.01, false);
  EXPECT_NEAR(height_m(), MouseHand::kHover_m, 5e-4);
  move(0.02, 0.01, true);
  wait(0.5);
  EXPECT_NEAR(height_m(), -MouseHand::kDefaultDepth_m, 5e-4);
  hand.deepen(0.002);
  wait(0.5);
  EXPECT_NEAR(height_m(), -MouseHand::kDefaultDepth_m - 0.002, 5e-4);
  move(0.02, 0.01, false);
  wait(0.5);
  EXPECT_NEAR(height_m(), MouseHand::kHover_m, 5e-4);
}

TEST_F(Mouse, is_lifted_where_it_is_when_the_button_is_let_go_elsewhere) {
  move(0.02, 0.01, true);
  wait(0.5);
  const Vec3 in_tissue = hand.wish()->position_m;
  move(0.4, 0.3, false);  // over what stands beside the picture
  wait(0.5);
  EXPECT_NEAR(height_m(), MouseHand::kHover_m, 5e-4);
  EXPECT_LT((hand.wish()->position_m - in_tissue).norm(), 0.02);
}

TEST_F(Mouse, lets_go_of_tissue_that_is_as_it_was_until_its_button_is_pressed_anew) {
  move(0.02, 0.01, true);
  wait(0.5);
  hand.lift();
  move(0.03, 0.01, true);
  wait(0.5);
  EXPECT_FALSE(hand.pressed());
  EXPECT_NEAR(height_m(), MouseHand::kHover_m, 5e-4);
  move(0.03, 0.01, false);
  move(0.03, 0.01, true);
  wait(0.5);
  EXPECT_NEAR(height_m(), -MouseHand::kDefaultDepth_m, 5e-4);
}

// The pointer is over the piece that the jaws hold: a hand that hovered over it would climb with it.
TEST_F(Mouse, lifts_what_closed_jaws_hold_and_does_not_climb_with_it) {
  move(0.02, 0.01, true);
  wait(0.5);
  move(0.02, 0.01, true, true);
  wait(0.5);
  for (int i = 0; i < 100; ++i) {
    const double lift_m = std::max(0.0, height_m());
    frame = ball(kRadius_m + lift_m);
    move(0.02 + 1e-4 * i, 0.01, false, true);
  }
  EXPECT_NEAR(height_m(), MouseHand::kCarry_m, 2e-3);  // straight up, and the ball falls away
  EXPECT_GT((hand.wish()->orientation * Vec3::UnitZ()).z(), std::cos(0.2) - 1e-3) << "upright, but for its lean";
  move(0.03, 0.01, false);
  move(0.03, 0.01, false);
  wait(1.0);
  EXPECT_GT(height_m(), MouseHand::kCarry_m) << "nothing is held: the skin counts where it is now";
}

TEST_F(Mouse, that_hovers_beside_the_tissue_stays_as_far_from_the_eye) {
  move(0, 0, false);
  hand.point({{Vec3(0, 0, 0.3), Vec3(0.5, 0, -0.2).normalized()}, false, false}, frame, Vec3::UnitX());
  hand.tick(now_s += 0.016);
  const double from_eye_m = (hand.wish()->position_m - Vec3(0, 0, 0.3)).norm();
  EXPECT_LT(from_eye_m, 0.25);
}

TEST_F(Mouse, stands_upright_across_a_thin_vessel) {
  frame = rod();
  const auto tilt = [&] {
    return (hand.wish()->orientation * Vec3::UnitZ()).head<2>().norm() - std::sin(0.2);  // the handle leans by 0.2
  };
  move(0, 0, false);
  move(0, -0.0045, false);
  move(0, -0.0045, true);
  for (double y = -0.0045; y <= 0.0045; y += 0.0005) {
    move(0, y, true);
    EXPECT_LT(std::abs(tilt()), 0.25) << y;
  }
}

TEST_F(Mouse, comes_into_a_thin_vessel_from_beside_it) {
  frame = rod();
  move(0, -0.02, true);
  wait(0.5);
  ASSERT_TRUE(hand.wish());
  EXPECT_EQ(hand.presses_beside(), 0U);
  EXPECT_LT(hand.wish()->position_m.y(), -0.018) << "not in the vessel yet";
  EXPECT_LT(hand.wish()->position_m.z(), -0.003) << "as deep as it goes in at the vessel's rim";
  const double from_rim_m = hand.wish()->position_m.z() + MouseHand::kDefaultDepth_m;
  EXPECT_NEAR(from_rim_m, 0, 0.0015) << "the rim is at half the vessel's height";
}

TEST_F(Mouse, counts_presses_where_there_is_no_body) {
  move(0.02, 0.01, true);
  move(0.4, 0.3, true);  // a stroke may leave the body
  move(0.4, 0.3, false);
  EXPECT_EQ(hand.presses_beside(), 0U);
  move(0.4, 0.3, true);
  move(0.4, 0.31, true);
  EXPECT_EQ(hand.presses_beside(), 1U);
}

// Over 8 cm the ball falls away by 1 cm: a hand that stayed in one plane would leave the tissue.
TEST_F(Mouse, follows_the_form_of_the_body_at_its_depth) {
  move(-0.04, 0, false);
  move(-0.04, 0, true);
  wait(0.5);
  for (double x = -0.04; x <= 0.04; x += 0.001) {
    move(x, 0, true);
    EXPECT_NEAR(height_m(), -MouseHand::kDefaultDepth_m, 1e-3) << x;
  }
}

// A blade that moves the tissue must not lead the hand deeper and deeper.
TEST_F(Mouse, follows_the_surface_as_it_was_when_the_button_went_down) {
  move(0, 0, false);
  move(0, 0, true);
  wait(0.5);
  for (auto& p : frame.bodies[0].positions_world_m) p.z() -= 0.01f;
  for (double x = 0; x <= 0.02; x += 0.001) move(x, 0, true);
  EXPECT_NEAR(height_m(), -MouseHand::kDefaultDepth_m, 1e-3);
}

TEST_F(Mouse, goes_on_in_the_plane_of_the_last_contact_over_a_cut) {
  for (Triangle& t : frame.bodies[0].triangles)
    if (frame.bodies[0].positions_world_m[t.v[0]].x() > 0.005f) t.surface = Surface::wall;
  move(0, 0, false);
  move(0, 0, true);
  wait(0.5);
  for (double x = 0; x <= 0.03; x += 0.001) move(x, 0, true);
  EXPECT_NEAR(hand.wish()->position_m.z(), kRadius_m - MouseHand::kDefaultDepth_m, 1.5e-3);
  EXPECT_NEAR(hand.wish()->position_m.x(), 0.03, 2e-3);
}

TEST_F(Mouse, a_new_hand_over_a_cut_takes_the_place_of_its_wall) {
  for (Triangle& triangle : frame.bodies[0].triangles) triangle.surface = Surface::wall;
  move(0.02, 0.01, false);
  ASSERT_TRUE(hand.wish());
  EXPECT_NEAR(hand.wish()->position_m.x(), 0.02, 1e-3);
}

TEST_F(Mouse, the_sharp_edge_leads) {
  move(0, -0.03, false);
  move(0, -0.03, true);
  for (double y = -0.03; y <= 0.03; y += 0.001) move(0, y, true);
  const Vec3 edge = hand.wish()->orientation * Vec3::UnitX();
  EXPECT_GT(edge.y(), 0.9);
  hand.roll(M_PI / 2);
  EXPECT_LT((hand.wish()->orientation * Vec3::UnitX()).x(), -0.9);
}

TEST_F(Mouse, the_edge_faces_along_a_stroke_from_its_first_millimetres) {
  move(0, 0.02, false);
  move(0, 0.02, true);
  for (double y = 0.02; y > 0.0175; y -= 0.0005) move(0, y, true);
  EXPECT_LT((hand.wish()->orientation * Vec3::UnitX()).y(), -0.9);
}

TEST_F(Mouse, the_second_button_closes_jaws) {
  move(0, 0, false);
  EXPECT_EQ(hand.wish()->opening_rad, MouseHand::kWidest_rad);
  move(0, 0, false, true);
  wait(0.6);
  EXPECT_EQ(hand.wish()->opening_rad, 0);
  move(0, 0, false, false);
  wait(0.6);
  EXPECT_EQ(hand.wish()->opening_rad, MouseHand::kWidest_rad);
}

TEST(Pick, finds_the_rim_beside_a_line_of_sight) {
  const SurfaceShot shot = shot_of(rod());
  const std::optional<Hit> rim = pick_beside(down_at(0, 0.02), shot, 0.03);
  ASSERT_TRUE(rim);
  EXPECT_NEAR(rim->point_world_m.y(), 0.005, 5e-4);
  EXPECT_GT(rim->normal_world.z(), 0) << "skin that faces the eye";
  EXPECT_FALSE(pick_beside(down_at(0, 0.04), shot, 0.03));
}

TEST(Pick, finds_the_nearest_of_two_surfaces) {
  Frame frame = ball(kRadius_m);
  frame.bodies.push_back(ball(0.12).bodies[0]);
  const auto hit = pick(down_at(0.01, 0.01), shot_of(frame));
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->point_world_m.norm(), 0.12, 5e-4);
  EXPECT_GT(hit->normal_world.z(), 0.9);
}

}  // namespace
}  // namespace sectio::page_test

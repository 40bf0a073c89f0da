#include "sim_server/trials/hand.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>

namespace sectio::trials_test {
namespace {

// Down, along x, and up again.
Trace stroke() {
  const auto at = [](double time_s, double x, double z) {
    TracePoint p;
    p.time_s = time_s;
    p.pose_world.position_m = Vec3(x, 0, z);
    return p;
  };
  return {at(0, 0, 0.05), at(1, 0, 0.02), at(3, 0.06, 0.02), at(4, 0.06, 0.05)};
}

Vec3 place(const Trace& trace, double time_s) {
  return pose_at(trace, time_s).position_m;
}

TEST(Hand, a_motion_is_rigid_and_turns_the_instrument_too) {
  const Motion motion{Vec3(0.03, 0, 0), M_PI / 2, Vec3(0, 0, 0.001)};
  const Trace trace = moved(stroke(), motion);
  EXPECT_LT((place(trace, 1) - Vec3(0.03, -0.03, 0.021)).norm(), 1e-12);
  EXPECT_LT((place(trace, 3) - Vec3(0.03, 0.03, 0.021)).norm(), 1e-12);
  EXPECT_LT((pose_at(trace, 1).orientation * Vec3::UnitX() - Vec3::UnitY()).norm(), 1e-12);
}

TEST(Hand, a_slow_hand_keeps_the_path) {
  const Trace trace = stretched(stroke(), 12);
  for (double t = 0; t <= 4; t += 0.1) EXPECT_LT((place(trace, 12 * t) - place(stroke(), t)).norm(), 1e-12);
}

TEST(Hand, who_waits_stands_still_and_then_goes_on) {
  const Trace trace = waiting(stroke(), 2, 1);
  EXPECT_EQ(place(trace, 2.5), place(stroke(), 2));
  EXPECT_LT((place(trace, 3.5) - place(stroke(), 2.5)).norm(), 1e-12);
  EXPECT_EQ(trace.back().time_s, 5);
  const Trace late = waiting(stroke(), 9, 1);  // after its end
  EXPECT_EQ(place(late, 11), place(stroke(), 4));
}

TEST(Hand, a_lift_leaves_and_comes_back_from_above) {
  const Trace trace = lifted(stroke(), 2, 0.04, 1.8);
  EXPECT_EQ(place(trace, 2), place(stroke(), 2));
  double highest_m = 0;
  for (double t = 2; t < 2 + kLiftTakes_s; t += 0.01) {
    const Vec3 x = place(trace, t);
    highest_m = std::max(highest_m, x.z());
    const bool between = x.x() < place(stroke(), 2).x() - 1e-9 && x.x() > place(stroke(), 1.8).x() + 1e-9;
    EXPECT_TRUE(!between || x.z() >= 0.06 - 1e-9) << "it moves along only where it is aloft";
  }
  EXPECT_NEAR(highest_m, 0.06, 1e-9);
  EXPECT_LT((place(trace, 2 + kLiftTakes_s) - place(stroke(), 1.8)).norm(), 1e-12);
  EXPECT_LT((place(trace, 2 + kLiftTakes_s + 0.5) - place(stroke(), 2.3)).norm(), 1e-12);
  for (std::size_t i = 1; i < trace.size(); ++i) EXPECT_GT(trace[i].time_s, trace[i - 1].time_s);
}

TEST(Hand, a_leaning_blade_is_drawn_out_of_its_slit) {
  Trace leaning = stroke();
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.7, Vec3::UnitX()));
  for (TracePoint& p : leaning) p.pose_world.orientation = turn;
  const Vec3 axis = turn * Vec3::UnitZ();
  const Trace trace = lifted(leaning, 2, 0.04, 2);
  double highest_m = 0;
  for (double t = 2; t < 2 + kLiftTakes_s; t += 0.01) {
    const Vec3 way = place(trace, t) - place(leaning, 2);
    highest_m = std::max(highest_m, way.z());
    EXPECT_LT(way.cross(axis).norm(), 1e-12) << t;
  }
  EXPECT_NEAR(highest_m, 0.04, 1e-9);
}

TEST(Hand, tremor_has_its_root_mean_square_between_8_and_12_hz) {
  Trace still = {stroke().front(), stroke().front()};
  still[1].time_s = 60;
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const Trace trace = trembling(still, 0.0003, seed);
    double sum = 0;
    for (const TracePoint& p : trace) sum += (p.pose_world.position_m - place(still, 0)).squaredNorm();
    EXPECT_NEAR(std::sqrt(sum / static_cast<double>(trace.size())), 0.0003, 0.00003);
    const auto power = [&](double hz) {
      std::complex<double> wave = 0;
      for (const TracePoint& p : trace)
        wave += (p.pose_world.position_m.x() - place(still, 0).x()) * std::polar(1.0, 2 * M_PI * hz * p.time_s);
      return std::norm(wave / static_cast<double>(trace.size()));
    };
    double inside = 0, outside = 0;
    for (double hz = 0.5; hz < 30; hz += 1.0 / 60) (hz > 7.9 && hz < 12.1 ? inside : outside) += power(hz);
    EXPECT_GT(inside, 100 * outside);
  }
}

TEST(Hand, a_place_on_the_way_is_by_length_and_not_by_time) {
  EXPECT_NEAR(time_at_path(stroke(), 0.5), 2, 1e-12);
  EXPECT_NEAR(time_at_path(stroke(), 0.25), 1, 1e-12);
  EXPECT_EQ(time_at_path({stroke().front()}, 0.5), 0);
}

Scene scene_of(std::vector<std::pair<std::string, Trace>> tools) {
  Scene scene;
  scene.duration_s = 4;
  scene.gravity_changes = {{3, Vec3(0, 0, -5)}};
  for (auto& [kind, trace] : tools) {
    ToolSpec tool;
    tool.kind = kind;
    tool.geometry = instrument_of(kind).geometry;
    tool.trace = std::move(trace);
    scene.tools.push_back(std::move(tool));
  }
  return scene;
}

TEST(Hand, a_seed_is_one_hand_and_a_flag_more_leaves_the_others) {
  const Scene scene = scene_of({{"scalpel", stroke()}});
  Hand hand{.shift_m = 0.001, .turn_deg = 3};
  EXPECT_EQ(in_hand(scene, hand, 7).tools[0].trace, in_hand(scene, hand, 7).tools[0].trace);
  EXPECT_NE(in_hand(scene, hand, 7).tools[0].trace, in_hand(scene, hand, 8).tools[0].trace);
  Hand slow = hand;
  slow.slower = 2;
  EXPECT_LT(
      (place(in_hand(scene, slow, 7).tools[0].trace, 4) - place(in_hand(scene, hand, 7).tools[0].trace, 2)).norm(),
      1e-12);
  for (std::uint64_t seed = 0; seed < 50; ++seed)
    for (double t = 0; t <= 4; t += 0.5)
      EXPECT_LT((place(in_hand(scene, hand, seed).tools[0].trace, t) - place(scene.tools[0].trace, t)).norm(),
                0.001 + 0.052 * 0.05);
}

TEST(Hand, those_that_do_not_cut_wait_while_others_are_lifted) {
  const Scene scene = scene_of({{"forceps", stroke()}, {"scalpel", stroke()}});
  const Scene lifts = in_hand(scene, {.lifts = 1}, 3);
  EXPECT_NEAR(lifts.duration_s, 4 + kLiftTakes_s, 1e-9);
  EXPECT_NEAR(lifts.gravity_changes[0].at_s, 3 + kLiftTakes_s, 1e-9);
  double highest_m = 0, lowest_m = 1;
  for (double t = 1.05; t < 4.5; t += 0.01) {
    highest_m = std::max(highest_m, place(lifts.tools[1].trace, t).z());
    lowest_m = std::min(lowest_m, place(lifts.tools[0].trace, t).z());
    EXPECT_NEAR(place(lifts.tools[0].trace, t).z(), 0.02, 1e-9) << t;
  }
  EXPECT_GE(highest_m, 0.04 - 1e-9);
  EXPECT_LT((place(lifts.tools[1].trace, 5.6) - place(stroke(), 4)).norm(), 1e-9);
  EXPECT_LT((place(lifts.tools[0].trace, 5.6) - place(stroke(), 4)).norm(), 1e-9);
}

// A block beneath the second half of the stroke.
void put_block(Scene& scene) {
  BodySpec block;
  for (const double z : {0.0, 0.03})
    for (const double y : {-0.02, 0.02})
      for (const double x : {0.03, 0.07}) block.mesh.vertices_body_m.emplace_back(x, y, z);
  block.mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                          {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  scene.bodies.push_back(block);
}

TEST(Hand, lifts_are_where_the_blade_is_in_tissue) {
  Scene scene = scene_of({{"scalpel", stroke()}});
  put_block(scene);
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Trace trace = in_hand(scene, {.lifts = 1}, seed).tools[0].trace;
    double left_at_x_m = 0;
    for (std::size_t i = 1; i < trace.size() && left_at_x_m == 0; ++i)
      if (trace[i].time_s > 1 && place(trace, trace[i].time_s).z() > 0.03)
        left_at_x_m = place(trace, trace[i - 1].time_s).x();
    EXPECT_GT(left_at_x_m, 0.035) << seed;
    EXPECT_LT(left_at_x_m, 0.06) << seed;
  }
}

TEST(Hand, what_has_been_set_going_takes_its_time_whatever_the_hand_does) {
  Scene scene = scene_of({{"scalpel", stroke()}});
  scene.duration_s = 6;  // 3 s after the turn of gravity, 2 s after the hand
  EXPECT_NEAR(in_hand(scene, {.faster = 4}, 1).duration_s, 3 / 4.0 + 3, 1e-12);
  EXPECT_NEAR(in_hand(scene, {.slower = 3}, 1).duration_s, 3 * 4 + 2, 1e-12);
}

TEST(Hand, a_fast_hand_need_not_touch_for_so_long) {
  Scene scene = scene_of({{"probe", stroke()}});
  const auto touched = std::ranges::find(measures(), "touched_s", &Measure::key);
  scene.expect = {{&*touched, at_least(1)}};
  EXPECT_EQ(in_hand(scene, {.faster = 4}, 1).expect[0].range.in_words(), "at least 0.25");
}

TEST(Hand, a_saw_goes_back_along_its_way_and_forth_again) {
  const Trace trace = sawing(stroke(), 3, 2);
  EXPECT_EQ(trace.back().time_s, stroke().back().time_s + 2);
  for (const double t : {0.25, 0.5, 0.75}) {
    EXPECT_LT((place(trace, 3 + t) - place(stroke(), 3 - t)).norm(), 1e-12) << t;
    EXPECT_LT((place(trace, 4 + t) - place(stroke(), 2 + t)).norm(), 1e-12) << t;
    EXPECT_LT((place(trace, 5 + t) - place(stroke(), 3 + t)).norm(), 1e-12) << t;
  }
  for (std::size_t i = 1; i < trace.size(); ++i) EXPECT_GT(trace[i].time_s, trace[i - 1].time_s);
}

TEST(Hand, in_words) {
  EXPECT_EQ(to_text({}), "exact");
  EXPECT_EQ(to_text({.shift_m = 0.001, .turn_deg = 3, .lifts = 1}), "shift 1 mm, turn 3 deg, lifts 1");
}

}  // namespace
}  // namespace sectio::trials_test

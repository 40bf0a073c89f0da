// A ball at the tip of a probe: pressed, held still, slid, drawn out and pushed through, in the simulation itself.
// Forces are the raw ones, before anything filters them for a hand.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/ball_on_block.h"
#include "tests/support/contact_reference.h"
#include "tests/support/gripper.h"
#include "tests/support/raw_reactions.h"

namespace sectio::round_instruments_test {
namespace {

struct Bed {
  std::string model;
  double tetrahedra = 6000, cell_m = 0;
  double square_m = 0.003;  // square of a surface
  double step_s = 0.001;
  std::string driver = "automatic";
};
std::ostream& operator<<(std::ostream& out, const Bed& bed) {
  return out << bed.model << " " << bed.tetrahedra << " " << bed.cell_m << " " << bed.driver;
}

constexpr double kYoung_pa = 6000, kPoisson = 0.45, kRadius_m = 0.004, kDepth_m = 0.003;
const Vec3 kBed_m(0.06, 0.04, 0.03);

Scene bed_under_ball(const Bed& bed) {
  const auto squares = [&](int axis) { return static_cast<int>(std::lround(kBed_m[axis] / bed.square_m)); };
  return test::ball_on_block({bed.model,
                              kBed_m,
                              {squares(0), squares(1), squares(2)},
                              kYoung_pa,
                              kPoisson,
                              kRadius_m,
                              kDepth_m,
                              bed.step_s,
                              bed.tetrahedra,
                              bed.cell_m,
                              bed.driver});
}

// The ball, its lowest point so deep.
class Ball {
 public:
  explicit Ball(const Bed& bed, double x_m = 0)
      : raw(std::make_shared<test::RawReactions>()), op(bed_under_ball(bed), test::engines_that_tell(raw)) {
    op.place(Vec3(x_m, 0, kBed_m.z() + kRadius_m + 0.001));
  }
  void press(double depth_m, double speed_m_per_s = 0.02) {
    op.move(Vec3(op.hand().position_m.x(), 0, kBed_m.z() + kRadius_m - depth_m), speed_m_per_s);
  }
  void hold(double for_s) {
    for (int n = 0; n < for_s / op.scene.step_s; ++n) op.step({{0, op.hand()}});
  }
  // Mean and standard deviation of the push upwards while `motion` goes on.
  template <class Motion>
  std::pair<double, double> push_n(const Motion& motion) {
    double sum = 0, squares = 0, count = 0;
    op.after_each = [&](const StepOutput&) {
      sum += raw->force_n.z(), squares += raw->force_n.z() * raw->force_n.z(), ++count;
      largest_jump_n = std::max(largest_jump_n, count > 1 ? std::abs(raw->force_n.z() - last_n_) : 0);
      last_n_ = raw->force_n.z();
      worst_friction = std::max(worst_friction, raw->worst_friction);
      least_n = std::min(least_n, last_n_);
    };
    motion();
    op.after_each = {};
    return {sum / count, std::sqrt(std::max(0.0, squares / count - sum * sum / count / count))};
  }
  double held_n() {
    press(kDepth_m), hold(0.4);
    return push_n([&] { hold(0.1); }).first;
  }

  std::shared_ptr<test::RawReactions> raw;
  test::Operation op;
  double largest_jump_n = 0, worst_friction = 0, least_n = HUGE_VAL;

 private:
  double last_n_ = 0;
};

// Meshes of very different sizes give the same force.
TEST(RoundInstruments, feel_the_same_on_coarse_and_on_fine_meshes) {
  const double form_n = test::ball_on_layer_n(kYoung_pa, kPoisson, kRadius_m, kDepth_m, kBed_m.z());
  for (const auto& [bed, within] : {std::pair{Bed{"neo_hookean", 1500}, 0.25},
                                    {Bed{"neo_hookean", 6000}, 0.1},
                                    {Bed{"neo_hookean_lattice", 27648, 0.0025}, 0.1},
                                    {Bed{"surface_springs", 0, 0, 0.003}, 0.2},
                                    {Bed{"surface_springs", 0, 0, 0.0015, 5e-4}, 0.2}})
    EXPECT_NEAR(Ball(bed).held_n() / form_n, 1, within) << bed;
}

TEST(RoundInstruments, feel_the_same_by_the_implicit_driver) {
  for (const char* model : {"neo_hookean", "tetra_springs", "neo_hookean_lattice"}) {
    Bed bed{model, 500, 0.01};
    const double explicit_n = Ball(bed).held_n();
    bed.driver = "implicit";
    Ball ball(bed);
    EXPECT_NEAR(ball.held_n() / explicit_n, 1, 0.06) << bed;
    ball.push_n([&] { ball.op.move(ball.op.hand().position_m + Vec3(0.004, 0, 0), 0.04); });
    EXPECT_LT(ball.worst_friction, 0.25) << bed;
    EXPECT_LT(ball.raw->force_n.x(), -0.1 * ball.raw->force_n.z()) << "friction holds it back: " << bed;
  }
}

TEST(RoundInstruments, at_rest_do_not_chatter) {
  for (const Bed& bed :
       {Bed{"neo_hookean", 1500}, {"neo_hookean_lattice", 3456, 0.005}, {"tetra_springs", 1500}, {"surface_springs"}}) {
    Ball ball(bed);
    ball.press(kDepth_m), ball.hold(0.5);
    const auto [mean_n, deviation_n] = ball.push_n([&] { ball.hold(0.2); });
    EXPECT_LT(deviation_n, 0.001 * mean_n) << bed;
  }
}

TEST(RoundInstruments, slide_evenly_with_no_more_friction_than_they_push) {
  struct Case {
    Bed bed;
    double ripple;
  };
  for (const auto& [bed, ripple] : {Case{{"neo_hookean", 6000}, 0.05},
                                    {{"neo_hookean_lattice", 27648, 0.0025}, 0.05},
                                    {{"surface_springs"}, 0.05}}) {
    Ball ball(bed, -0.01);
    ball.press(kDepth_m), ball.hold(0.4);
    ball.op.move(ball.op.hand().position_m + Vec3(0.002, 0, 0), 0.01);
    const auto [mean_n, deviation_n] =
        ball.push_n([&] { ball.op.move(ball.op.hand().position_m + Vec3(0.018, 0, 0), 0.01); });
    EXPECT_LT(deviation_n, ripple * mean_n) << bed;
    EXPECT_LT(ball.largest_jump_n, 0.01 * mean_n) << bed;
    EXPECT_LT(ball.worst_friction, 0.2001) << bed;
    EXPECT_LT(ball.raw->force_n.x(), -0.1 * mean_n) << bed;
  }
}

// A dashpot in the contact itself would grow with the number of steps.
TEST(RoundInstruments, damp_nothing_by_themselves) {
  const auto rise_n = [](double step_s) {
    Ball ball({.model = "neo_hookean", .tetrahedra = 1500, .step_s = step_s});
    ball.press(kDepth_m), ball.hold(0.4);
    const double from_n = ball.push_n([&] { ball.hold(0.05); }).first;
    ball.press(kDepth_m + 0.0005, 0.05);
    return ball.raw->force_n.z() - from_n;
  };
  EXPECT_NEAR(rise_n(0.0005) / rise_n(0.001), 1, 0.1);
}

TEST(RoundInstruments, do_not_pull_after_they_have_gone_through) {
  for (const Bed& bed : {Bed{"neo_hookean", 500}, {"neo_hookean_lattice", 500, 0.005}, {"surface_springs"}}) {
    Ball ball(bed);
    const double start_j = ball.op.simulation.energy_j();
    const double below_m = kBed_m.z() + 0.02;
    ball.push_n([&] { ball.press(below_m, 0.1); });
    ball.least_n = HUGE_VAL;
    ball.push_n([&] { ball.hold(0.3); });
    EXPECT_GT(ball.least_n, -0.01) << bed;
    EXPECT_LT(ball.op.force_n().norm(), 0.05) << bed;
    ball.press(-0.02, 0.1), ball.hold(0.2);
    EXPECT_EQ(ball.op.state(), ContactState::free) << bed;
    EXPECT_EQ(ball.op.count(EventKind::body_frozen), 0u) << bed;
    // A thin surface can also slide off sideways, without a word.
    const bool slips = bed.model != "surface_springs";
    EXPECT_TRUE(!slips || std::ranges::any_of(
                              ball.op.events,
                              [](const Event& e) { return e.kind == EventKind::contact_ended && !e.text.empty(); }))
        << "says that the skin slipped off: " << bed;
    ball.op.rest(1000);
    EXPECT_EQ(ball.op.count(EventKind::driver_taken_over), ball.op.count(EventKind::driver_handed_back)) << bed;
    EXPECT_LT(ball.op.simulation.energy_j() - start_j, 1e-6) << "as it was: " << bed;
  }
}

// A ball that presses a side is felt alike whether its shaft stands upright beside the block or points away from it.
TEST(RoundInstruments, press_a_side_with_the_shaft_beside_the_body) {
  for (const Bed& bed : {Bed{"neo_hookean", 1500}, {"neo_hookean_lattice", 3456, 0.005}, {"tetra_springs", 1500}}) {
    const auto pressed_n = [&](const Eigen::Quaterniond& turn, double height_m) {
      test::Operation op(bed_under_ball(bed));
      std::vector<double> force_n;
      for (int i = 0; i <= 300; ++i) {
        const double depth_m = -0.001 + i * 1.5e-5;
        op.step({{0, {Vec3(-0.5 * kBed_m.x() - kRadius_m + depth_m, 0, height_m), turn}}});
        force_n.push_back(-op.force_n(0).x());
      }
      return force_n;
    };
    const Eigen::Quaterniond upright = Eigen::Quaterniond::Identity(),
                             away(Eigen::AngleAxisd(-0.5 * M_PI, Vec3::UnitY()));
    for (const double height_m : {0.015, 0.02, 0.026}) {
      const std::vector<double> beside_n = pressed_n(upright, height_m), away_n = pressed_n(away, height_m);
      const double most_n = std::ranges::max(away_n);
      EXPECT_GT(most_n, 0.05) << bed;
      for (std::size_t i = 0; i < beside_n.size(); ++i)
        ASSERT_NEAR(beside_n[i], away_n[i], 0.08 * most_n) << bed << ", " << height_m << " m, step " << i;
    }
  }
}

// Two balls squeeze the block from its sides, and open again.
TEST(RoundInstruments, let_go_of_what_two_of_them_squeeze) {
  for (const Bed& bed : {Bed{"neo_hookean", 1500}, {"neo_hookean_lattice", 3456, 0.005}, {"tetra_springs", 1500}}) {
    Scene scene = bed_under_ball(bed);
    scene.tools.push_back(scene.tools[0]);
    scene.tools[1].name = "other";
    test::Operation op(scene);
    const auto start = op.simulation.positions_world_m(0);
    const std::vector<Vec3f> before(start.begin(), start.end());
    const auto at = [&](double gap_m) {
      const double x_m = 0.5 * kBed_m.x() + kRadius_m + gap_m;
      op.step({{0, {Vec3(-x_m, 0, 0.02), Eigen::Quaterniond::Identity()}},
               {1, {Vec3(x_m, 0, 0.02), Eigen::Quaterniond::Identity()}}});
    };
    constexpr int kSteps = 400;
    const double from_m = 0.002, to_m = -0.004;
    for (int i = 0; i <= kSteps; ++i) at(from_m + (to_m - from_m) * i / kSteps);
    EXPECT_GT(op.force_n(0).norm(), 0.05) << bed;
    EXPECT_NEAR((op.force_n(0) + op.force_n(1)).x(), 0, 0.35 * op.force_n(0).norm())
        << "alike but for the mesh on either side: " << bed;
    for (int i = 0; i <= kSteps; ++i) at(to_m + (from_m - to_m) * i / kSteps);
    op.rest(600);
    EXPECT_EQ(op.state(0), ContactState::free) << bed;
    EXPECT_EQ(op.state(1), ContactState::free) << bed;
    float apart_m = 0;
    const auto now = op.simulation.positions_world_m(0);
    for (std::size_t i = 0; i < now.size(); ++i) apart_m = std::max(apart_m, (now[i] - before[i]).norm());
    EXPECT_LT(apart_m, 1e-4f) << "nothing sticks to a ball: " << bed;
  }
}

}  // namespace
}  // namespace sectio::round_instruments_test

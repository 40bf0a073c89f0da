// Instruments that are faster than any hand, and samples of them that come when they like, through the whole
// simulation.
#include <gtest/gtest.h>

#include <map>

#include "common/math/fixed_sequence.h"
#include "tests/support/block_scene.h"
#include "tests/support/operation.h"

namespace sectio {
namespace {

using test::Operation;

class Instruments : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(All, Instruments,
                         testing::Values("surface_springs", "tetra_springs", "neo_hookean", "neo_hookean_lattice"),
                         [](const auto& model) { return model.param; });

// A block of 60 x 60 x 40 mm that is held at its lower side, and a probe or scalpel above it.
Scene block_under(const std::string& tool, const std::string& model) {
  Scene scene = test::block_scene(model);
  scene.file = "block";
  scene.floor_z_m.reset();
  BodySpec& body = scene.bodies[0];
  body.mesh = test::box(8, 8, 5, Vec3(0.06, 0.06, test::kBlockTop_m));
  body.volume.least_part_s = 1e-4;
  body.cutting.style = model == "surface_springs" ? body.cutting.style : "progressive";
  body.cutting.threshold_force_n = 0.1;
  body.fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, 0.004)};
  scene.tools.emplace_back();
  scene.tools[0].name = tool;
  scene.tools[0].kind = tool;
  scene.tools[0].geometry = instrument_of(tool).geometry;
  return scene;
}

// The conditions after every step, whatever an instrument does.
struct Watch {
  explicit Watch(Operation& op) : op_(op), start_j_(op.simulation.energy_j()) {
    op.after_each = [this](const StepOutput& out) { look(out); };
  }
  void look(const StepOutput& out) {
    for (std::uint32_t b = 0; b < op_.simulation.body_count(); ++b)
      for (const Vec3f& x : op_.simulation.positions_world_m(b)) {
        ASSERT_TRUE(x.allFinite()) << "step " << out.step;
        ASSERT_LT(x.norm(), 1) << "step " << out.step;
      }
    EXPECT_GE(out.report.stability_margin, 1) << "step " << out.step;
    most_work_j = std::max(most_work_j, out.report.instrument_work_j);
    for (const ContactModel& c : out.contacts) most_force_n = std::max(most_force_n, c.force_world_n.norm());
    if (out.step % 10 == 0) most_energy_j = std::max(most_energy_j, op_.simulation.energy_j() - start_j_);
  }
  double most_work_j = 0, most_force_n = 0, most_energy_j = 0;

 private:
  Operation& op_;
  double start_j_;
};

// A probe is driven 15 mm deep, along and out again.
TEST_P(Instruments, S_8_speeds_from_1_cm_to_2_m_a_second) {
  for (const double speed_m_per_s : {0.01, 0.1, 0.5, 2.0}) {
    SCOPED_TRACE(speed_m_per_s);
    Operation op(block_under("probe", GetParam()));
    op.rest(50);
    const double start_j = op.simulation.energy_j();
    Watch watch(op);
    op.place(Vec3(0.001, 0.002, test::kBlockTop_m + 0.002));
    op.move(Vec3(0.001, 0.002, test::kBlockTop_m - 0.015), speed_m_per_s);
    op.move(Vec3(0.008, 0.002, test::kBlockTop_m - 0.015), speed_m_per_s);
    op.move(Vec3(0.008, 0.002, test::kBlockTop_m + 0.03), std::max(0.1, speed_m_per_s));
    op.rest(400);
    op.expect_valid();
    EXPECT_EQ(op.count(EventKind::body_frozen), 0u);
    EXPECT_EQ(op.count(EventKind::driver_taken_over), op.count(EventKind::driver_handed_back));
    EXPECT_GT(watch.most_force_n, 0.1);
    EXPECT_LT(watch.most_force_n, 6);
    EXPECT_LT(watch.most_energy_j, 1.1 * watch.most_work_j);
    EXPECT_LT(op.simulation.energy_j() - start_j, 1e-6) << "as it was";
  }
}

// The place of the instrument at a time: down, along, and still.
Vec3 path_m(double time_s) {
  const auto share = [&](double from_s, double to_s) {
    return std::clamp((time_s - from_s) / (to_s - from_s), 0.0, 1.0);
  };
  return {0.001 + 0.004 * share(0.3, 0.5), 0.002, test::kBlockTop_m + 0.002 - 0.008 * share(0, 0.25)};
}

struct Arrival {
  const char* name;
  std::function<std::vector<double>()> times_s;  // times of the samples, ascending
  int held_back;                                 // samples: all but the last wait for the last
};

// Samples at 1 kHz, as frames of other rates with half of an interval's jitter, in bursts, and with gaps: nothing is
// thrown about by what the net does to them, and once the instrument rests the tissue is the same.
TEST_P(Instruments, S_9_samples_that_come_irregularly) {
  constexpr double kEnd_s = 0.6;
  const auto at_rate = [=](double rate_hz, double jitter, double lost) {
    std::vector<double> times{0.001};
    for (int n = 1; n / rate_hz < kEnd_s; ++n)
      if (std::abs(fixed_sequence(2 * static_cast<std::size_t>(n))) >= lost)
        times.push_back((n + jitter * fixed_sequence(2 * static_cast<std::size_t>(n) + 1)) / rate_hz);
    times.push_back(kEnd_s);
    return times;
  };
  const auto with_gaps = [=] {
    std::vector<double> times;
    for (double t = 0.001; t < kEnd_s; t += 0.001)
      if (!(t > 0.1 && t < 0.22) && !(t > 0.35 && t < 0.55)) times.push_back(t);
    times.push_back(kEnd_s);
    return times;
  };
  const Arrival arrivals[] = {
      {"1 kHz", [=] { return at_rate(1000, 0, 0); }, 1},     {"250 Hz", [&] { return at_rate(250, 0.5, 0); }, 1},
      {"125 Hz", [=] { return at_rate(125, 0.5, 0.1); }, 1}, {"60 Hz", [&] { return at_rate(60, 0.5, 0.2); }, 1},
      {"bursts", [=] { return at_rate(1000, 0, 0); }, 24},   {"gaps", with_gaps, 1}};
  // A probe that rests this deep in surface springs keeps them swinging: they stay bounded and never come to rest. In
  // the others friction holds the skin where the probe has dragged it, and that depends on the way.
  const std::map<std::string, float> kApart_m{
      {"surface_springs", 0.02f}, {"tetra_springs", 3e-3f}, {"neo_hookean", 4e-3f}, {"neo_hookean_lattice", 3e-3f}};
  const float apart_m = kApart_m.at(GetParam());
  std::vector<Vec3f> regular;
  for (const Arrival& arrival : arrivals) {
    SCOPED_TRACE(arrival.name);
    Operation op(block_under("probe", GetParam()));
    Watch watch(op);
    const std::vector<double> times_s = arrival.times_s();
    std::size_t next = 0;
    for (int n = 1; n <= 900; ++n) {
      StepInput input;
      std::size_t due = next;
      while (due < times_s.size() && times_s[due] < 0.001 * n + 1e-9) ++due;
      if (due - next >= static_cast<std::size_t>(arrival.held_back) || due == times_s.size())
        for (; next < due; ++next) {
          input.samples.push_back(op.sample(0, Pose{path_m(times_s[next])}));
          input.samples.back().tool_time_s = times_s[next];
        }
      op.step(input);
    }
    EXPECT_EQ(next, times_s.size());
    EXPECT_EQ(op.count(EventKind::body_frozen), 0u);
    // After a gap the probe stands several millimetres deeper within one step.
    EXPECT_LE(watch.most_force_n, arrival.name == std::string("gaps") ? ToolSpec().largest_force_n + 1e-6 : 5);
    const auto now = op.simulation.positions_world_m(0);
    if (regular.empty()) regular.assign(now.begin(), now.end());
    float apart = 0;
    for (std::size_t i = 0; i < now.size(); ++i) apart = std::max(apart, (now[i] - regular[i]).norm());
    EXPECT_LT(watch.most_energy_j, 1.1 * watch.most_work_j);
    EXPECT_LT(apart, apart_m) << "from where samples at 1 kHz leave it";
  }
}

}  // namespace
}  // namespace sectio

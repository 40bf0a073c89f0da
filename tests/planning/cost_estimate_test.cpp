// The cost that the planner expects of a body against its true cost, as a report tells it, both measured in this run:
// the processor's time, the least of several stretches.
#include <gtest/gtest.h>

#include <algorithm>

#include "common/core/processor_time.h"
#include "sim_server/engine/standard_engines.h"
#include "sim_server/prepare/machine_speed.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/session/trace_player.h"
#include "sim_server/simulation.h"
#include "tests/planning/planned_specimens.h"

namespace sectio::test {
namespace {

using planning::Load;

constexpr double kFactor = 1.4;  // 1.3 is the aim
// Other programs halve the machine's speed within seconds, between its measurement and that of a case too: a case is
// repeated until it is within its factor, and an estimate that is wrong never is.
constexpr int kTries = 5;

class Cost : public testing::TestWithParam<PlannedCase> {};

const PlannedCase kCases[] = {
    {"coarse_bar", Load::bending, {0.12, 0.02, 0.02}, {}, 20000, 0.45, 0.04},
    {"fine_bar", Load::bending, {0.12, 0.02, 0.02}, {}, 20000, 0.45, 0.011},
    {"stiff_bar", Load::bending, {0.09, 0.03, 0.03}, {}, 300000, 0.3, 0.02},
    {"plate", Load::bending, {0.06, 0.04, 0.01}, {}, 80000, 0.4, 0.02},
    {"odd_bar", Load::bending, {0.083, 0.0217, 0.0171}, {}, 30000, 0.45, 0.1},
    {"soft_bar", Load::bending, {0.06, 0.02, 0.02}, {}, 5000, 0.48, 0.015},
    {"twisted_bar", Load::twisting, {0.12, 0.02, 0.02}, {}, 20000, 0.45, 0.1},
    {"twisted_ruler", Load::twisting, {0.09, 0.03, 0.015}, {}, 40000, 0.4, 0.05},
    {"block", Load::indentation, {0.06, 0.06, 0.03}, {}, 6000, 0.45, 0.12, 0.012, 0.003},
    {"fine_block", Load::indentation, {0.06, 0.06, 0.03}, {}, 6000, 0.45, 0.07, 0.012, 0.003},
    {"touched_block", Load::indentation, {0.08, 0.08, 0.04}, {}, 10000, 0.45, 0.45, 0.01, 0.002, 16},
    {"cut_bar", Load::opening, {0.05, 0.01, 0.024}, {}, 30000, 0.45, 0.25, 0.01, 0.012},
    {"cut_odd_bar", Load::opening, {0.067, 0.013, 0.0191}, {}, 15000, 0.4, 0.3, 0.01, 0.00955},
};
INSTANTIATE_TEST_SUITE_P(Of, Cost, testing::ValuesIn(kCases), [](const auto& c) { return c.param.name; });

// While a probe presses or forceps twist; blades, which change what there is to simulate, are not at work yet.
double cost_of(Scene scene) {
  for (ToolSpec& tool : scene.tools)
    if (tool.kind == "scalpel") tool.trace = {tool.trace[0]};
  constexpr int kStretches = 16, kSteps = 25;
  Simulation simulation(prepared(scene));
  simulation.measure_with(processor_time_s);
  double least_s = 1e9, so_far_s = 0;
  std::uint64_t step = 0;
  // Instruments are in contact from here on.
  const bool presses = std::ranges::any_of(scene.tools, [](const ToolSpec& t) { return t.trace.size() > 1; });
  while (presses && static_cast<double>(step) * scene.step_s < 0.4) {
    StepInput input;
    input.samples = samples_of_traces(scene, ++step);
    so_far_s = simulation.step(input).report.processor_s[0];
  }
  for (int n = 0; n < kStretches; ++n) {
    StepInput input;
    double took_s = 0;
    for (int i = 0; i < kSteps; ++i) {
      input.samples = samples_of_traces(scene, ++step);
      const double body_s = simulation.step(input).report.processor_s[0];
      took_s += body_s - so_far_s;
      so_far_s = body_s;
    }
    least_s = std::min(least_s, took_s);
  }
  return least_s / (kSteps * scene.step_s);
}

TEST_P(Cost, is_near_the_estimate) {
  std::vector<double> ratios;
  const auto is_near = [&](double ratio) { return ratio < kFactor && ratio > 1 / kFactor; };
  while (ratios.size() < kTries && std::ranges::none_of(ratios, is_near)) {
    const PlannedScene planned =
        plan_scene(scene_of(GetParam()), standard_engines(), measure_calibration(standard_engines()));
    const BodySpec& body = planned.scene.bodies[0];
    const double cost = cost_of(planned.scene);
    ratios.push_back(*body.plan.cpu_estimate / cost);
    std::printf("%-16s %-20s expected %.4f s/s, is %.4f, ratio %.2f\n", GetParam().name.c_str(), body.model.c_str(),
                *body.plan.cpu_estimate, cost, ratios.back());
  }
  EXPECT_TRUE(std::ranges::any_of(ratios, is_near)) << testing::PrintToString(ratios) << ", factor " << kFactor;
}

}  // namespace
}  // namespace sectio::test

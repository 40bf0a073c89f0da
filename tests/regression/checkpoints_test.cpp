// Every scene of deploy/scenes goes on from its own state: at many moments, in the middle of cuts, too, the state is
// saved and read by a new simulation, which takes the steps from there as the first one does, and has the same state
// after them, bit for bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sim_server/engine/standard_traits.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/session/step_record.h"
#include "sim_server/session/trace_player.h"
#include "sim_server/simulation.h"
#include "tests/regression/shipped_scenes.h"

namespace sectio {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kSavedEvery = 307;  // steps; a prime, so that the moments are of all kinds
constexpr std::uint64_t kCompared = 40;     // steps after each of them

Scene scene_of(const std::string& name) {
  return prepared(load_scene((kScenes / (name + ".yaml")).string(), standard_traits()));
}

std::string difference_between(const StepOutput& a, const StepOutput& b) {
  if (a.deltas.size() != b.deltas.size()) return "deltas";
  for (std::size_t i = 0; i < a.deltas.size(); ++i)
    if (a.deltas[i].body_id != b.deltas[i].body_id || a.deltas[i].delta != b.deltas[i].delta) return "a delta";
  if (a.events.size() != b.events.size()) return "events";
  for (std::size_t i = 0; i < a.events.size(); ++i)
    if (a.events[i].kind != b.events[i].kind || a.events[i].text != b.events[i].text) return "an event";
  if (a.contacts.size() != b.contacts.size()) return "contacts";
  for (std::size_t i = 0; i < a.contacts.size(); ++i)
    if (a.contacts[i].force_world_n != b.contacts[i].force_world_n ||
        a.contacts[i].stiffness_n_per_m != b.contacts[i].stiffness_n_per_m)
      return "a contact";
  return a.report.checks == b.report.checks && a.report.instrument_work_j == b.report.instrument_work_j ? "" : "report";
}

class Checkpoints : public testing::TestWithParam<std::string> {};

TEST_P(Checkpoints, a_new_simulation_goes_on_from_the_state) {
  const Scene scene = scene_of(GetParam());
  Simulation whole(scene);
  std::optional<Simulation> again;
  const std::uint64_t last = steps_of(scene, 0);
  for (std::uint64_t step = 1; step <= last; ++step) {
    StepInput input;
    input.samples = samples_of_traces(scene, step);
    const StepOutput& output = whole.step(input);
    if (again) {
      ASSERT_EQ(difference_between(output, again->step(input)), "") << "step " << step;
      ASSERT_EQ(state_hash_of(*again), state_hash_of(whole)) << "step " << step;
    }
    const bool begins = step % kSavedEvery == 0;
    if (!begins && step % kSavedEvery != kCompared && step != last) continue;
    const auto state = whole.save();
    ASSERT_TRUE(state);
    // Equal bytes: all that follows is equal, too.
    if (again) {
      ASSERT_TRUE(again->save() == state) << "step " << step;
    }
    again.reset();
    if (!begins) continue;
    again.emplace(scene);
    again->load(*state);
    ASSERT_TRUE(again->save() == state) << "step " << step;
  }
}

INSTANTIATE_TEST_SUITE_P(AllScenes, Checkpoints, testing::ValuesIn(scene_names()),
                         [](const auto& scene) { return scene.param; });

TEST(CheckpointsOfAScene, bytes_that_end_too_early_are_refused) {
  const Scene scene = scene_of("kidney_loop");
  Simulation simulation(scene);
  StepInput input;
  for (std::uint64_t step = 1; step <= 1500; ++step) {
    input.samples = samples_of_traces(scene, step);
    simulation.step(input);
  }
  const std::vector<std::uint8_t> state = simulation.save().value();
  for (const std::size_t bytes : {std::size_t{0}, std::size_t{7}, state.size() / 3, state.size() - 1})
    EXPECT_ANY_THROW(Simulation(scene).load(std::span(state).first(bytes))) << bytes;
}

}  // namespace
}  // namespace sectio

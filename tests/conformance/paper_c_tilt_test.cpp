// Gravity's direction can be changed while running, as when the patient is tilted, and the tissue follows (paper C, the
// surgeon's wishes).
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "common/delta/journal.h"
#include "sim_server/body_contact/rigid_body.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/session/recorder.h"
#include "sim_server/session/trace_player.h"
#include "sim_server/simulation.h"
#include "sim_server/world/turning_gravity.h"
#include "tests/support/shapes.h"

namespace sectio {
namespace {

const Vec3 kDown(0, 0, -9.81), kToTheSide(9.81, 0, 0);

TEST(C_EXP, C_EXP_3_gravity_turns_at_a_bounded_rate_and_arrives_exactly) {
  for (const Vec3& target : {kToTheSide, Vec3(0, 0, 9.81), Vec3(1, -2, -3), Vec3(0, 0, 0), kDown}) {
    Vec3 now = kDown;
    int steps = 0;
    for (; now != target && steps < 2000; ++steps) {
      const Vec3 next = turned_towards(now, target, 0.002, 0.02);
      EXPECT_LT((next - now).norm(), 0.002 * 9.82 + 0.02 + 1e-12);
      const double cosine = next.normalized().dot(now.normalized());
      EXPECT_TRUE(cosine > std::cos(0.00201) || next.norm() < 0.1 || now.norm() < 0.1) << cosine;
      now = next;
    }
    EXPECT_EQ(now, target);
  }
  EXPECT_NEAR(turned_towards(kDown, kToTheSide, 0.01, 1).norm(), 9.81, 1e-9) << "as strong as before on its way";
}

// A soft block that stands on what is fixed.
Scene standing_block(const std::string& model) {
  Scene scene;
  scene.bodies.emplace_back();
  BodySpec& body = scene.bodies[0];
  body.name = "block";
  body.model = model;
  body.mesh = test::box(4, 4, 8, Vec3(0.03, 0.03, 0.06));
  body.material.young_pa = 10000;
  body.material.damping_per_s = 60;
  body.volume.tetrahedra = 600;
  body.volume.cell_m = 0.006;
  body.fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, 0.001)};
  scene.gravity_turns_deg_per_s = 360;
  return scene;
}

Vec3 middle_m(const Simulation& simulation) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3f& x : simulation.positions_world_m(0)) sum += x.cast<double>();
  return sum / static_cast<double>(simulation.positions_world_m(0).size());
}

class Tilted : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(All, Tilted,
                         testing::Values("surface_springs", "tetra_springs", "neo_hookean", "neo_hookean_lattice"));

TEST_P(Tilted, C_EXP_3_the_tissue_follows) {
  Simulation simulation(prepared(standing_block(GetParam())));
  for (int n = 0; n < 600; ++n) simulation.step({});
  const Vec3 upright = middle_m(simulation);
  StepInput input;
  input.gravity_m_per_s2 = kToTheSide;
  const StepOutput& out = simulation.step(input);
  ASSERT_EQ(out.events.size(), 1u);
  EXPECT_EQ(out.events[0].kind, EventKind::gravity_turned);
  EXPECT_EQ(out.gravity_target_m_per_s2, kToTheSide);
  EXPECT_GT(out.gravity_m_per_s2.dot(kDown.normalized()), 9.8) << "it has hardly begun";
  for (int n = 0; n < 1000; ++n) simulation.step({});
  EXPECT_EQ(out.gravity_m_per_s2, kToTheSide);
  const Vec3 aside = middle_m(simulation) - upright;
  EXPECT_GT(aside.x(), 5e-5);
  EXPECT_LT(std::abs(aside.y()), 0.1 * aside.x());
}

TEST_P(Tilted, C_EXP_3_by_plan_or_by_request_it_is_the_same) {
  Scene planned = standing_block(GetParam());
  planned.gravity_changes = {{0.05, kToTheSide}, {0.2, kDown}};
  Simulation by_plan(prepared(planned)), by_request(prepared(standing_block(GetParam())));
  for (int n = 1; n <= 300; ++n) {
    by_plan.step({});
    StepInput input;
    if (n == 50) input.gravity_m_per_s2 = kToTheSide;
    if (n == 200) input.gravity_m_per_s2 = kDown;
    by_request.step(input);
  }
  const auto a = by_plan.positions_world_m(0), b = by_request.positions_world_m(0);
  EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin(), b.end()));
}

// A session in which somebody tilts the table while a knife cuts a half off, and what its journal makes of it.
struct Session {
  explicit Session(const std::vector<JournalGravity>& requests, const std::string& directory = {})
      : scene(load_scene(SECTIO_SOURCE_DIR "/deploy/scenes/bar_one_sequence.yaml", standard_traits())),
        simulation(scene),
        record(scene, simulation, directory) {
    record.begin_journal();
    std::size_t next = 0;
    for (std::uint64_t k = 1; k <= kSteps; ++k) {
      StepInput input;
      input.samples = samples_of_traces(scene, k);
      for (; next < requests.size() && requests[next].step == k; ++next)
        input.gravity_m_per_s2 = requests[next].gravity_m_per_s2;
      record.add(simulation.step(input), 0);
      if (k == kTilted && simulation.body_count() > 1) {
        before_m = simulation.rigid_body(1)->pose_world().position_m;
        was_asleep = simulation.rigid_body(1)->asleep();
      }
    }
    record.finish();
  }
  static constexpr std::uint64_t kTilted = 3999, kSteps = 6500;
  Scene scene;
  Simulation simulation;
  Recorder record;
  Vec3 before_m = Vec3::Zero();
  bool was_asleep = false;
};

TEST(C_EXP, C_EXP_3_what_sleeps_wakes_and_slides_and_the_journal_replays_to_the_same) {
  namespace fs = std::filesystem;
  const fs::path directory = fs::path(testing::TempDir()) / ("sectio_tilt_" + std::to_string(getpid()));
  const Session session({{1500, Vec3(0, 2, -9.6)}, {2200, kDown}, {4000, Vec3(7, 0, -7)}}, directory.string());
  ASSERT_EQ(session.simulation.body_count(), 2u);
  EXPECT_TRUE(session.was_asleep);
  EXPECT_GT(session.simulation.rigid_body(1)->pose_world().position_m.x(), session.before_m.x() + 0.05)
      << "45 degrees are more than its friction holds";

  const std::string journal = (directory / "journal").string();
  const std::vector<JournalGravity> gravity = read_gravity(journal);
  ASSERT_EQ(gravity.size(), 3u);
  EXPECT_EQ(gravity[1].step, 2200u);
  EXPECT_EQ(gravity[1].gravity_m_per_s2, kDown);
  const std::vector<JournalBody> rebuilt = read_journal(journal);
  const Session again(gravity);
  ASSERT_EQ(rebuilt.size(), 2u);
  for (std::uint32_t b = 0; b < 2; ++b) {
    EXPECT_EQ(rebuilt[b].mesh.hash(), session.simulation.mesh(b).hash());
    EXPECT_EQ(again.simulation.mesh(b).hash(), session.simulation.mesh(b).hash());
    const auto p = again.simulation.positions_world_m(b), q = session.simulation.positions_world_m(b);
    EXPECT_TRUE(std::equal(p.begin(), p.end(), q.begin(), q.end()));
  }
  const Session upright({});
  EXPECT_NE(upright.simulation.mesh(0).hash(), session.simulation.mesh(0).hash()) << "the tilt changed the cut";
  fs::remove_all(directory);
}

}  // namespace
}  // namespace sectio

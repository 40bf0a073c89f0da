// Somebody writes nonsense into a body: nothing but good numbers leaves the step, and the body is mended.
#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "sim_server/engine/standard_engines.h"
#include "sim_server/session/recorder.h"
#include "sim_server/surface/surface_engines.h"
#include "sim_server/world/body.h"
#include "tests/support/block_scene.h"
#include "tests/support/operation.h"

namespace sectio {
namespace {

using test::Operation;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();

struct Harm {
  const char* name;
  float value;
  bool velocity, held, all;  // velocities; held vertices; all vertices
};
constexpr Harm kHarms[] = {
    {"position", kNan, false, false, false},           {"held position", kNan, false, true, false},
    {"velocity", kInfinity, true, false, false},       {"held velocity", kNan, true, true, false},
    {"far away", 1e9f, false, false, false},           {"fast", 1e30f, true, false, false},
    {"all positions", -kInfinity, false, false, true}, {"all velocities", kNan, true, true, true},
};

// A process that does harm when the test says so.
class Injector final : public ProcessEngine {
 public:
  explicit Injector(const Harm* const* harm) : harm_(harm) {}
  void follow(const SharedBody&, const TopologyChange&) override {}
  void step(const SharedBody& body, double) override {
    if (!*harm_) return;
    auto& entries = (*harm_)->velocity ? body.particles.velocity_world_m_per_s : body.particles.position_world_m;
    int done = 0;
    for (VertexId v = 0; v < entries.size(); ++v) {
      const bool inside = v >= body.mesh.vertex_slots();  // a volume's inner vertices come last
      const bool held = !inside && body.mesh.vertex_alive(v) && body.mesh.rest_body_m(v).z() < 0.004;
      if (!(*harm_)->all && (held != (*harm_)->held || done++ > 2)) continue;
      entries[v].head<3>().setConstant((*harm_)->value);
    }
  }

 private:
  const Harm* const* harm_;
};

Scene block_under_scalpel(const std::string& model) {
  Scene scene = test::block_scene(model);
  scene.file = "block";
  scene.floor_z_m.reset();
  BodySpec& body = scene.bodies[0];
  body.volume.tetrahedra = 600;
  body.volume.cell_m = 0.01;
  body.cutting.threshold_force_n = 0.1;
  body.fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, 0.004)};
  scene.tools.resize(1);
  scene.tools[0].name = "scalpel";
  scene.processes.push_back({"harm", "harm", {"block"}, {}});
  return scene;
}

EngineTable with_injector(const Harm* const* harm) {
  EngineTable table = standard_engines();
  table.processes.push_back({{.kind = "harm", .meaning = "Does harm."},
                             [harm](const ProcessSite&) { return std::make_unique<Injector>(harm); },
                             {}});
  return table;
}

void expect_good(Simulation& simulation, const StepOutput& out, double largest_n) {
  for (std::uint32_t b = 0; b < simulation.body_count(); ++b)
    for (const Vec3f& x : simulation.positions_world_m(b)) {
      ASSERT_TRUE(x.allFinite()) << "step " << out.step;
      ASSERT_LE(x.cwiseAbs().maxCoeff(), 10) << "step " << out.step;
    }
  for (const ContactModel& c : out.contacts) {
    ASSERT_TRUE(c.force_world_n.allFinite() && c.point_world_m.allFinite() && c.normal_world.allFinite());
    ASSERT_LE(c.force_world_n.norm(), largest_n * (1 + 1e-12));
  }
  ASSERT_TRUE(std::isfinite(out.report.instrument_work_j) && std::isfinite(out.report.penetration_m));
  ASSERT_TRUE(std::isfinite(simulation.energy_j()));
}

class Guard : public testing::TestWithParam<std::string> {
 protected:
  const Harm* harm = nullptr;
};
INSTANTIATE_TEST_SUITE_P(All, Guard,
                         testing::Values("surface_springs", "tetra_springs", "neo_hookean", "neo_hookean_lattice"),
                         [](const auto& model) { return model.param; });

TEST_P(Guard, lets_no_bad_number_out_and_mends_the_body) {
  for (const Harm& h : kHarms) {
    SCOPED_TRACE(h.name);
    Operation op(block_under_scalpel(GetParam()), with_injector(&harm));
    Recorder record(op.scene, op.simulation, "");
    op.after_each = [&](const StepOutput& out) {
      expect_good(op.simulation, out, op.scene.tools[0].largest_force_n);
      record.add(out, 0);
    };
    op.rest(400);
    const auto now = op.simulation.positions_world_m(0);
    const std::vector<Vec3f> before(now.begin(), now.end());
    harm = &h;
    op.rest(1);
    harm = nullptr;
    EXPECT_EQ(op.count(EventKind::body_recovered), 1u);
    op.rest(400);
    EXPECT_EQ(op.count(EventKind::body_recovered), 1u);
    EXPECT_EQ(op.count(EventKind::body_frozen), 0u);
    const auto after = op.simulation.positions_world_m(0);
    for (std::size_t v = 0; v < before.size(); ++v) ASSERT_LT((after[v] - before[v]).norm(), 5e-4) << v;
    const RunResult result = record.finish();
    EXPECT_EQ(result.report.find("null"), std::string::npos) << "no number of the report is bad";
  }
}

TEST_P(Guard, freezes_what_is_harmed_again_and_again_and_sets_it_free_when_it_is_left_alone) {
  Operation op(block_under_scalpel(GetParam()), with_injector(&harm));
  op.after_each = [&](const StepOutput& out) { expect_good(op.simulation, out, op.scene.tools[0].largest_force_n); };
  op.rest(100);
  harm = &kHarms[0];
  op.rest(10);
  EXPECT_EQ(op.count(EventKind::body_recovered), 3u);
  EXPECT_EQ(op.count(EventKind::body_frozen), 1u);
  harm = nullptr;
  op.place(Vec3(0, 0, test::kBlockTop_m + 0.002));
  op.move(Vec3(0, 0, test::kBlockTop_m - 0.012), 0.05);
  op.move(Vec3(0.015, 0, test::kBlockTop_m - 0.012), 0.05);
  EXPECT_EQ(op.last.report.cuts_made, 0u);
  op.move(Vec3(0.015, 0, test::kBlockTop_m + 0.03), 0.1);
  op.rest(1500);
  EXPECT_EQ(op.count(EventKind::body_thawed), 1u);
  EXPECT_EQ(op.count(EventKind::body_frozen), 1u);
  op.place(Vec3(0, 0, test::kBlockTop_m + 0.002));
  op.move(Vec3(0, 0, test::kBlockTop_m - 0.012), 0.05);
  op.move(Vec3(0.015, 0, test::kBlockTop_m - 0.012), 0.05);
  EXPECT_GT(op.last.report.cuts_made, 0u);
  op.expect_valid();
}

// A blade that is in a body when it freezes: the stroke ends, and says why.
TEST_P(Guard, refuses_cuts_in_a_frozen_body) {
  Operation op(block_under_scalpel(GetParam()), with_injector(&harm));
  op.place(Vec3(-0.01, 0, test::kBlockTop_m + 0.002));
  op.move(Vec3(-0.01, 0, test::kBlockTop_m - 0.012), 0.05);
  op.move(Vec3(0, 0, test::kBlockTop_m - 0.012), 0.05);
  ASSERT_GT(op.last.report.cuts_made, 0u);
  harm = &kHarms[0];
  op.rest(10);
  harm = nullptr;
  ASSERT_EQ(op.count(EventKind::body_frozen), 1u);
  op.move(Vec3(0.01, 0, test::kBlockTop_m - 0.012), 0.05);
  const auto refused = std::ranges::find(op.events, EventKind::cut_refused, &Event::kind);
  ASSERT_NE(refused, op.events.end());
  EXPECT_EQ(refused->text, "the body is frozen");
  op.expect_valid();
}

// A body that moves as a whole: its last pose comes back.
TEST(GuardOfPieces, mends_a_piece_and_stops_one_at_the_end_of_the_world) {
  Scene scene;
  BodySpec spec;
  spec.splitting.free_parts = FreeParts::rigid;
  const TriangleMesh block(test::box(3, 3, 2, Vec3(0.03, 0.03, 0.02)));
  Body body(spec, scene, 0, surface_spring_engines, block, particles_at_rest(block.rest_body_m(), {}), Pose{});
  ASSERT_NE(body.rigid(), nullptr);
  const auto step = [&](const std::optional<Vec3>& velocity_m_per_s) {
    body.deform({}, {}, scene.step_s);
    if (velocity_m_per_s) body.rigid()->body.set_velocity(*velocity_m_per_s, Vec3::Zero());
    if (!body.frozen) body.rigid()->move(body.shared(), false), body.particles_moved();
    return body.guard(false, scene.step_s);
  };
  ASSERT_TRUE(step(std::nullopt).empty());
  const Vec3 at = body.rigid()->body.pose_world().position_m;
  const auto events = step(Vec3::Constant(NAN));
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].first, EventKind::body_recovered);
  EXPECT_EQ(body.rigid()->body.pose_world().position_m, at);
  for (const Vec3f& x : body.positions_world_m()) ASSERT_TRUE(x.allFinite());
  std::map<EventKind, int> times;
  for (int n = 0; n < 5000; ++n)
    for (const auto& [kind, text] : step(Vec3(0, 0, -40))) ++times[kind];
  EXPECT_EQ(times, (std::map<EventKind, int>{{EventKind::left_world, 1}}));
  EXPECT_TRUE(body.frozen);
  for (const Vec3f& x : body.positions_world_m()) EXPECT_LE(x.cwiseAbs().maxCoeff(), 10);
}

}  // namespace
}  // namespace sectio

// Paper A, 2.3: instruments beside the scalpel. Knife with a sharp and a blunt part, scissors, scissors with U-form
// blades, probe.
#include <gtest/gtest.h>

#include <random>

#include "common/mesh/check.h"
#include "tests/support/operation.h"
#include "tests/support/random.h"

namespace sectio::test {
namespace {

Scene scene_with(const char* kind) {
  Scene scene = organ_scene();
  scene.tools[0].kind = kind;
  scene.tools[0].geometry = instrument_of(kind).geometry;
  return scene;
}

// No delta comes out of it.
template <class Act>
void expect_only_deforms(Operation& op, const Act& act) {
  const TriangleMesh before = op.mesh();
  const std::size_t deltas = op.deltas;
  double felt_n = 0;
  op.after_each = [&](const StepOutput& out) { felt_n = std::max(felt_n, out.contacts[0].force_world_n.norm()); };
  act();
  op.after_each = nullptr;
  EXPECT_EQ(op.deltas, deltas);
  EXPECT_TRUE(op.mesh().same_database(before));
  EXPECT_GT(felt_n, 0.05) << "felt";
}

TEST(A_TOOL, A_TOOL_1_the_sharp_part_of_a_knife_cuts) {
  Operation op(scene_with("knife"));
  op.place({-0.02, 0.001, organ_height_m(-0.02, 0.001) + 0.004});
  op.tip_to(-0.02, 0.001, 0.005);
  op.tip_to(0.01, 0.001, 0.005);
  EXPECT_GT(op.walls(), 20u);
  op.expect_valid();
}

TEST(A_TOOL, A_TOOL_1_a_knife_that_lies_on_its_blunt_part_only_deforms) {
  Operation op(scene_with("knife"));
  // The whole edge AC level, above the top with its blunt end; the tip beyond the side of the organ.
  const Vec3 edge = op.scene.tools[0].geometry.c_tool_m.normalized();
  const Eigen::Quaterniond lying = Eigen::Quaterniond::FromTwoVectors(edge, Vec3::UnitX());
  op.place({-0.028, 0.001, kOrganTop_m + 0.003}, lying);
  expect_only_deforms(op, [&] { op.move({-0.028, 0.001, kOrganTop_m - 0.003}); });
  EXPECT_EQ(op.state(), ContactState::contact);
}

TEST(A_TOOL, A_TOOL_1_the_blunt_part_of_a_knife_only_deforms) {
  Operation op(scene_with("knife"));
  op.place({-0.02, 0.001, organ_height_m(-0.02, 0.001) + 0.004});
  op.tip_to(-0.02, 0.001, 0.004);
  op.tip_to(-0.01, 0.001, 0.004);
  ASSERT_GT(op.walls(), 8u) << "the sharp part meets the surface";
  op.tip_to(-0.01, 0.001, 0.014, 0.2);
  op.rest(5);
  expect_only_deforms(op, [&] { op.tip_to(-0.006, 0.001, 0.014); });
  EXPECT_LT(op.force_n().x(), -0.05) << "held";
  const std::size_t walls = op.walls();
  op.tip_to(-0.006, 0.001, 0.004);
  op.tip_to(0.004, 0.001, 0.004);
  EXPECT_GT(op.walls(), walls) << "it cuts again once the sharp part meets the surface";
  op.expect_valid();
}

TEST(A_TOOL, A_TOOL_1_a_probe_never_cuts) {
  Scene scene = scene_with("probe");
  scene.bodies[0].cutting.threshold_force_n = 1e-3;
  Operation op(scene);
  op.place({0, 0.001, kOrganTop_m + 0.004});
  expect_only_deforms(op, [&] {
    op.tip_to(0, 0.001, 0.006);
    op.tip_to(0.015, 0.004, 0.006);
  });
  EXPECT_EQ(op.state(), ContactState::contact);
  EXPECT_GT(op.force_n().z(), 0.1);
  EXPECT_EQ(op.deltas, 0u);
  op.tip_to(0.015, 0.004, -0.01);
  EXPECT_EQ(op.state(), ContactState::free);
}

// Jaws.

constexpr double kOpen_rad = 0.5;

struct Snip {
  explicit Snip(const char* kind, const char* style = "progressive") : op(made(kind, style)) {}
  static Scene made(const char* kind, const char* style) {
    Scene scene = scene_with(kind);
    scene.bodies[0].cutting.style = style;
    return scene;
  }
  // The tips, when closed, at (x, y), beneath the skin by the depth given.
  void hold(double x_m, double y_m, double depth_m, double opening_rad) {
    at = {x_m, y_m, organ_height_m(x_m, y_m) - depth_m};
    opening = opening_rad;
    feed();
  }
  void move(double x_m, double y_m, double depth_m) {
    const Vec3 from = at, to(x_m, y_m, organ_height_m(x_m, y_m) - depth_m);
    const int n = std::max(1, static_cast<int>(std::ceil((to - from).norm() / 0.02 / 0.001)));
    for (int i = 1; i <= n; ++i) {
      at = from + (to - from) * i / n;
      feed();
    }
  }
  void jaws(double to_rad, double seconds = 0.5) {
    const double from = opening;
    const int n = static_cast<int>(seconds / 0.001);
    for (int i = 1; i <= n; ++i) {
      opening = from + (to_rad - from) * i / n;
      feed();
    }
  }
  void feed() {
    StepInput input;
    input.samples.push_back(op.sample(0, {at, orientation}));
    input.samples.back().opening_rad = opening;
    op.step(input);
  }

  Operation op;
  Vec3 at = Vec3::Zero();
  double opening = 0;
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
};

// Rest positions of what the cut has opened, from lowest to highest x.
std::pair<double, double> walls_from_to_m(const TriangleMesh& mesh) {
  double from = 1, to = -1;
  for (const Triangle& t : mesh.triangles())
    if (t.alive() && t.surface == Surface::wall)
      for (const VertexId v : t.v) {
        from = std::min(from, mesh.rest_body_m(v).x());
        to = std::max(to, mesh.rest_body_m(v).x());
      }
  return {from, to};
}

TEST(A_TOOL, A_TOOL_2_open_blades_only_push) {
  Snip snip("scissors");
  snip.hold(0.01, 0.001, -0.025, kOpen_rad);
  expect_only_deforms(snip.op, [&] { snip.move(0.01, 0.001, 0.003); });
  EXPECT_EQ(snip.op.state(), ContactState::contact);
  expect_only_deforms(snip.op, [&] {
    snip.move(0.02, 0.001, 0.003);
    snip.jaws(kOpen_rad + 0.2);
  });
}

TEST(A_TOOL, A_TOOL_2_they_cut_where_the_blades_cross_as_they_close) {
  Snip snip("scissors");
  snip.hold(0.01, 0.001, -0.025, kOpen_rad);
  snip.move(0.01, 0.001, 0.004);
  ASSERT_EQ(snip.op.walls(), 0u);
  snip.jaws(0.13);
  const auto half = walls_from_to_m(snip.op.mesh());
  EXPECT_GT(snip.op.walls(), 8u);
  const auto crossing_x_m = [&] {
    const InstrumentKind& scissors = instrument_of("scissors");
    InstrumentState state;
    state.opening_rad = snip.opening;
    const InstrumentShape s = scissors.shape(scissors.geometry, state);
    return snip.at.x() + (s.edge_tip_tool_m - scissors.geometry.d_tool_m + scissors.geometry.a_tool_m).x();
  };
  EXPECT_NEAR(half.second, crossing_x_m(), 0.003) << "the cut ends at the crossing";
  snip.jaws(0.1);
  const auto whole = walls_from_to_m(snip.op.mesh());
  EXPECT_GT(whole.second, half.second + 0.004) << "and follows it";
  EXPECT_NEAR(whole.second, crossing_x_m(), 0.003);
  snip.op.expect_valid();
  EXPECT_EQ(snip.op.last.report.cuts_refused, 0u);

  snip.jaws(kOpen_rad);
  snip.move(0.01, 0.001, -0.03);
  EXPECT_EQ(snip.op.state(), ContactState::free);
  EXPECT_EQ(snip.op.count(EventKind::cut_ended), 1u) << "one snip, one cut";
  snip.op.expect_valid();
  EXPECT_EQ(check(snip.op.mesh()).euler_characteristic, 2);
}

// Paper A, figure 6: angle above 90 degrees. Each snip goes on where the one before ended, wherever the blades are put.
TEST(A_TOOL, A_TOOL_2_snips_from_the_rim_cut_a_sheet_through) {
  for (const double aside_m : {0.0, 0.0004, -0.0003}) {
    Scene scene = scene_with("scissors");
    const Vec3 size_m(0.06, 0.04, 0.005);
    scene.bodies[0].mesh = box(24, 16, 2, size_m);
    for (Vec3& x : scene.bodies[0].mesh.vertices_body_m) x -= size_m / 2;
    scene.bodies[0].cutting.style = "templates";
    scene.bodies[0].fixed = Box{Vec3(-1, -1, -1), Vec3(-0.02, 1, 1)};
    scene.tools[0].geometry = {Vec3::Zero(), Vec3(-0.1, 0, 0), Vec3(-0.06, 0, 0), Vec3(0, 0, -0.006)};
    Operation op(scene);
    const auto snip = [&](double tips_y_m, double from_rad, double to_rad) {
      for (int i = 0; i <= 400; ++i) {
        StepInput input;
        const Eigen::Quaterniond towards_y(Eigen::AngleAxisd(1.54, Vec3::UnitZ()));
        input.samples.push_back(op.sample(0, {{0.0061 + aside_m, tips_y_m, 0}, towards_y}));
        input.samples.back().opening_rad = from_rad + (to_rad - from_rad) * i / 400;
        op.step(input);
      }
    };
    for (const double tips_y_m : {0.022, 0.033}) {
      snip(tips_y_m, 0.4, 0.2);
      op.expect_valid();
      snip(tips_y_m, 0.2, 0.4);
    }
    EXPECT_GE(op.count(EventKind::penetrated), 2u) << aside_m;  // the blades may break in again where they went on
    EXPECT_LE(op.count(EventKind::penetrated), 3u) << aside_m;
    EXPECT_EQ(op.count(EventKind::cut_ended), 2u) << aside_m;
    EXPECT_EQ(op.count(EventKind::cut_refused), 0u) << aside_m;
    EXPECT_EQ(check(op.mesh()).euler_characteristic, 2) << "a slit; a bridge between the snips would make a handle";
    Box3 walls;
    for (const Triangle& t : op.mesh().triangles())
      if (t.alive() && t.surface == Surface::wall)
        for (const VertexId v : t.v) walls.extend(op.mesh().rest_body_m(v));
    EXPECT_LT(walls.min().y(), -0.0195) << "from the rim";
    EXPECT_GT(walls.max().y(), 0.0);
    EXPECT_LT(walls.min().z(), -0.00249) << "from one side of the sheet";
    EXPECT_GT(walls.max().z(), 0.00249) << "to the other";
  }
}

TEST(A_TOOL, A_TOOL_2_jaws_that_stand_still_cut_nothing_more) {
  Snip snip("scissors");
  snip.hold(0.01, 0.001, -0.025, kOpen_rad);
  snip.move(0.01, 0.001, 0.006);
  snip.jaws(0.13);
  ASSERT_GT(snip.op.walls(), 8u);
  const auto before = walls_from_to_m(snip.op.mesh());
  snip.move(0.014, 0.001, 0.006);
  const auto after = walls_from_to_m(snip.op.mesh());
  EXPECT_NEAR(after.second, before.second, 1e-9);
}

TEST(A_TOOL, A_TOOL_3_both_edges_of_each_u_cut) {
  for (const char* style : {"progressive", "templates"}) {
    Snip snip("medical_scissors", style);
    snip.hold(0.01, 0.001, -0.025, kOpen_rad);
    snip.move(0.01, 0.001, 0.003);
    EXPECT_EQ(snip.op.walls(), 0u) << "open blades only push";
    snip.jaws(0.1, 1.0);
    // Two cuts, one under each edge.
    std::size_t left = 0, right = 0, elsewhere = 0;
    const double half_gauge_m = 0.5 * snip.op.scene.tools[0].geometry.gauge_m;
    const TriangleMesh& mesh = snip.op.mesh();
    for (const Triangle& t : mesh.triangles()) {
      if (!t.alive() || t.surface != Surface::wall) continue;
      const double y = (mesh.rest_body_m(t.v[0]).y() + mesh.rest_body_m(t.v[1]).y() + mesh.rest_body_m(t.v[2]).y()) / 3;
      const bool l = std::abs(y - 0.001 - half_gauge_m) < 0.0015, r = std::abs(y - 0.001 + half_gauge_m) < 0.0015;
      left += l, right += r, elsewhere += !l && !r;
    }
    EXPECT_GT(left, 8u) << style;
    EXPECT_GT(right, 8u) << style;
    EXPECT_EQ(elsewhere, 0u) << style;
    snip.op.expect_valid();
    EXPECT_EQ(check(mesh).euler_characteristic, 2) << style;
    snip.jaws(kOpen_rad);
    snip.move(0.01, 0.001, -0.03);
    EXPECT_EQ(snip.op.state(), ContactState::free) << style;
    snip.op.expect_valid();
  }
}

// A hand may do anything: jumps, half closed jaws, leaning tools, the same place again.
class AnyTool : public testing::TestWithParam<std::tuple<const char*, const char*>> {};
INSTANTIATE_TEST_SUITE_P(A_TOOL, AnyTool,
                         testing::Combine(testing::Values("knife", "scissors", "medical_scissors", "probe"),
                                          testing::Values("progressive", "templates")),
                         [](const auto& p) { return std::string(std::get<0>(p.param)) + "_" + std::get<1>(p.param); });

TEST_P(AnyTool, A_TOOL_3_the_surface_stays_closed) {
  test::Random64 random(11);
  std::uniform_real_distribution<double> u(-1, 1);
  Snip snip(std::get<0>(GetParam()), std::get<1>(GetParam()));
  for (int i = 0; i < 8; ++i) {
    const Vec3 axis = Vec3(0.2 * u(random), 0.2 * u(random), 1).normalized();
    snip.orientation = Eigen::AngleAxisd(M_PI * u(random), axis);
    const double x = 0.03 * u(random), y = 0.03 * u(random);
    snip.hold(x, y, -0.02, 0.3 + 0.2 * u(random));
    snip.move(x, y, 0.004 + 0.003 * u(random));
    snip.jaws(0.05 + 0.1 * std::abs(u(random)), 0.2);
    snip.move(x + 0.01 * u(random), y + 0.01 * u(random), 0.004 + 0.003 * u(random));
    snip.jaws(0.5 * std::abs(u(random)), 0.1);
    if (i % 3 != 0) snip.move(x, y, -0.02);
    ASSERT_NO_FATAL_FAILURE(snip.op.expect_valid()) << i;
    ASSERT_TRUE(snip.op.force_n().allFinite()) << i;
  }
  EXPECT_EQ(snip.op.count(EventKind::body_frozen), 0u);
  EXPECT_EQ(snip.op.walls() > 0, std::get<0>(GetParam()) != std::string("probe"));
}

}  // namespace
}  // namespace sectio::test

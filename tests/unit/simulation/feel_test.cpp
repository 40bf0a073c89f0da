// The contact model that the hand gets, from a scene file through the simulation: the body that is touched or near, its
// surface before the touch, and the velocity of the tissue.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "sim_server/engine/standard_engines.h"
#include "sim_server/prepare/prepare.h"
#include "tests/support/operation.h"

namespace sectio::test {
namespace {

namespace fs = std::filesystem;

constexpr double kTop_m = 0.03;

// A soft block around x = y = 0 and a firm one beside it, around x = 0.1.
constexpr const char* kTwoBlocks = R"(session: feel
step_s: 0.001
duration_s: 2
gravity_m_per_s2: [0, 0, 0]
bodies:
  - name: soft
    mesh: {file: block.obj, unit: m}
    pose: {position_world_m: [-0.03, -0.03, 0]}
    material: {young_pa: 3000, friction: 0.1}
    cutting: {threshold_force_n: 0.3}
    fixed: {min_world_m: [-1, -1, -1], max_world_m: [1, 1, 0.001]}
  - name: firm
    mesh: {file: block.obj, unit: m}
    pose: {position_world_m: [0.07, -0.03, 0]}
    material: {young_pa: 30000, friction: 0.4}
    cutting: {threshold_force_n: 2}
    fixed: {min_world_m: [-1, -1, -1], max_world_m: [1, 1, 0.001]}
tools:
  - {name: blade, kind: scalpel}
  - {name: rod, kind: probe}
)";

// Something that carries a whole body up and down, as breathing does.
class Breath final : public ProcessEngine {
 public:
  static constexpr double kAmplitude_m = 0.004, kRate_rad_per_s = 2 * std::numbers::pi;

  void follow(const SharedBody&, const TopologyChange&) override {}
  void step(const SharedBody& body, double step_s) override {
    const Vec3 velocity(0, 0, velocity_m_per_s(time_s_ += step_s));
    for (VertexId v = 0; v < body.mesh.vertex_slots(); ++v)
      body.particles.place(v, body.particles.view().position(v) + step_s * velocity, velocity);
  }

  static double velocity_m_per_s(double time_s) {
    return kAmplitude_m * kRate_rad_per_s * std::cos(kRate_rad_per_s * time_s);
  }

 private:
  double time_s_ = 0;
};

class Feel : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "sectio_feel_XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    std::ofstream obj(folder_ / "block.obj");
    const TriangleSoup block = box(12, 12, 6, Vec3(0.06, 0.06, kTop_m));
    for (const Vec3& p : block.vertices_body_m) obj << "v " << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
    for (const auto& t : block.triangles) obj << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
  }
  void TearDown() override { fs::remove_all(folder_); }

  Scene scene(const std::string& text, const EngineTable& table = standard_engines()) const {
    std::ofstream(folder_ / "scene.yaml") << text;
    return prepared(load_scene((folder_ / "scene.yaml").string(), table.traits()), table);
  }

  fs::path folder_;
};

std::string with(std::string text, const std::string& before, const std::string& added) {
  const std::size_t at = text.find(before);
  EXPECT_NE(at, std::string::npos);
  return text.insert(at, added);
}

constexpr std::uint32_t kBlade = 0, kRod = 1;

// The part of the force at a place that the hand adds by itself.
double response_n(const ContactModel& model, const Vec3& tip_m) {
  return force_n(model, dent_of(model, {model.tool_time_s, tip_m, Vec3::Zero(), Vec3::Zero()}));
}

TEST_F(Feel, the_hand_feels_the_body_that_its_tool_touches) {
  Operation operation(scene(kTwoBlocks));
  operation.place(Vec3(0.5, 0, 0.1), Eigen::Quaterniond::Identity(), kBlade);
  operation.place(Vec3(0, 0, kTop_m + 0.001), Eigen::Quaterniond::Identity(), kRod);
  const auto pressed = [&](double x_m) {
    operation.move(Vec3(x_m, 0, kTop_m + 0.01), 0.2, kRod);
    operation.move(Vec3(x_m, 0, kTop_m + 0.001), 0.02, kRod);
    operation.move(Vec3(x_m, 0, kTop_m - 0.002), 0.02, kRod);
    EXPECT_EQ(operation.state(kRod), ContactState::contact);
    return operation.last.contacts.at(kRod);
  };
  const ContactModel soft = pressed(0), firm = pressed(0.1), again = pressed(0.005);
  EXPECT_DOUBLE_EQ(soft.friction, 0.1);
  EXPECT_DOUBLE_EQ(firm.friction, 0.4);
  EXPECT_DOUBLE_EQ(again.friction, 0.1);
  EXPECT_GT(firm.stiffness_n_per_m, 4 * soft.stiffness_n_per_m) << "of ten times the modulus";
  EXPECT_NEAR(again.stiffness_n_per_m, soft.stiffness_n_per_m, 0.5 * soft.stiffness_n_per_m);
  EXPECT_EQ(firm.yield_n, operation.scene.tools[kRod].largest_force_n) << "a rod doesn't pierce";
}

TEST_F(Feel, a_blade_feels_no_more_than_the_force_at_which_the_tissue_under_it_breaks) {
  Operation operation(scene(kTwoBlocks));
  for (const auto& [x_m, threshold_n] : {std::pair{0.0, 0.3}, std::pair{0.1, 2.0}}) {
    operation.place(Vec3(x_m, 0, kTop_m + 0.003));
    EXPECT_EQ(operation.state(), ContactState::free);
    EXPECT_DOUBLE_EQ(operation.last.contacts[kBlade].yield_n, threshold_n);
  }
}

TEST_F(Feel, far_from_all_bodies_there_is_nothing_to_feel) {
  Operation operation(scene(kTwoBlocks));
  operation.place(Vec3(0, 0, kTop_m + 0.05));
  const ContactModel& model = operation.last.contacts[kBlade];
  EXPECT_EQ(model.stiffness_n_per_m, 0);
  EXPECT_EQ(response_n(model, Vec3(0, 0, -1)), 0);
  Scene empty = scene(kTwoBlocks);
  empty.bodies.clear();
  Operation in_the_air(empty);
  in_the_air.place(Vec3(0, 0, kTop_m));
  EXPECT_EQ(in_the_air.last.contacts[kBlade].stiffness_n_per_m, 0);
}

TEST_F(Feel, the_surface_is_known_before_the_touch_and_beside_the_body) {
  Operation operation(scene(kTwoBlocks));
  operation.place(Vec3(0.002, 0.003, kTop_m + 0.008));
  const ContactModel above = operation.last.contacts[kBlade];
  EXPECT_EQ(above.state, ContactState::free);
  EXPECT_NEAR((above.normal_world - Vec3::UnitZ()).norm(), 0, 1e-6);
  EXPECT_NEAR(above.point_world_m.z(), kTop_m, 1e-6);
  EXPECT_EQ(response_n(above, Vec3(0, 0, kTop_m + 1e-4)), 0);
  EXPECT_GT(response_n(above, Vec3(0, 0, kTop_m - 5e-4)), 0);

  operation.place(Vec3(-0.038, 0, 0.015), Eigen::Quaterniond(Eigen::AngleAxisd(-M_PI / 2, Vec3::UnitY())));
  const ContactModel beside = operation.last.contacts[kBlade];
  EXPECT_NEAR((beside.normal_world + Vec3::UnitX()).norm(), 0, 1e-6);
  EXPECT_GT(response_n(beside, Vec3(-0.0295, 0, 0.015)), 0);
}

// The bridge evaluates the newest model that has come, 25 ms old.
TEST_F(Feel, a_first_touch_is_felt_within_two_steps_whatever_the_delay) {
  for (const char* model : {"surface_springs", "neo_hookean"}) {
    Operation operation(
        scene(with(kTwoBlocks, "    material: {young_pa: 3000", "    model: " + std::string(model) + "\n")));
    operation.place(Vec3(0.5, 0, 0.1), Eigen::Quaterniond::Identity(), kBlade);
    std::vector<ContactModel> sent;
    int felt = -1, touched = -1;
    for (int i = 0; i < 400 && (felt < 0 || touched < 0); ++i) {
      const Vec3 tip_m(0.001, 0.002, kTop_m + 0.012 - 0.05e-3 * i);
      operation.place(tip_m, Eigen::Quaterniond::Identity(), kRod);
      sent.push_back(operation.last.contacts.at(kRod));
      const ContactModel& old = sent[sent.size() > 25 ? sent.size() - 26 : 0];
      if (felt < 0 && response_n(old, tip_m) > 1e-4) felt = i;
      if (touched < 0 && operation.force_n(kRod).norm() > 1e-4) touched = i;
    }
    ASSERT_GE(touched, 0) << model;
    ASSERT_GE(felt, 0) << model;
    EXPECT_LE(std::abs(felt - touched), 2) << model;
  }
}

TEST_F(Feel, a_surface_that_moves_carries_the_hand_along) {
  EngineTable table = standard_engines();
  table.processes.push_back({{.kind = "breath", .meaning = "Carries a body up and down."},
                             [](const ProcessSite&) { return std::make_unique<Breath>(); },
                             {}});
  std::string text = kTwoBlocks;
  text += "processes:\n  - {name: lungs, kind: breath, bodies: [soft]}\n";
  for (const double height_m : {0.012, -0.001}) {  // near, and pressed
    Operation operation(scene(text, table), table);
    operation.place(Vec3(0.5, 0, 0.1), Eigen::Quaterniond::Identity(), kBlade);
    double worst = 0;
    for (int i = 0; i < 500; ++i) {
      operation.place(Vec3(0.001, 0.002, kTop_m + height_m), Eigen::Quaterniond::Identity(), kRod);
      if (i < 100) continue;
      const ContactModel& model = operation.last.contacts.at(kRod);
      worst = std::max(
          worst, std::abs(model.velocity_world_m_per_s.z() - Breath::velocity_m_per_s(operation.last.sim_time_s)));
    }
    EXPECT_LT(worst, 0.25 * Breath::kAmplitude_m * Breath::kRate_rad_per_s) << height_m;
  }
}

// The tissue around a dent moves with it a little: nothing but the hand moves here.
TEST_F(Feel, the_plane_under_a_hand_stays_when_only_the_hand_moves) {
  for (const double hz : {2.0, 10.0, 40.0}) {
    Operation operation(scene(kTwoBlocks));
    operation.place(Vec3(0.5, 0, 0.1), Eigen::Quaterniond::Identity(), kBlade);
    double plane_m[2] = {1, -1}, most_m_per_s = 0;
    for (int i = 0; i < 2000; ++i) {
      const double depth_m =
          std::min(0.002, -0.002 + 2e-5 * i) + (i < 300 ? 0 : 0.0005) * std::sin(2e-3 * M_PI * hz * i);
      operation.place(Vec3(0.101, 0.002, kTop_m - depth_m), Eigen::Quaterniond::Identity(), kRod);
      if (i < 1000) continue;
      const ContactModel& model = operation.last.contacts.at(kRod);
      plane_m[0] = std::min(plane_m[0], model.point_world_m.z());
      plane_m[1] = std::max(plane_m[1], model.point_world_m.z());
      most_m_per_s = std::max(most_m_per_s, model.velocity_world_m_per_s.norm());
    }
    EXPECT_LT(plane_m[1] - plane_m[0], 1e-4) << hz << " Hz";
    EXPECT_LT(most_m_per_s, 0.06 * 0.0005 * 2 * M_PI * hz) << hz << " Hz";
  }
}

// A block on a table, and a probe of 1.5 mm radius.
std::string block_of(const std::string& model) {
  return R"(session: feel
step_s: 0.001
duration_s: 2
gravity_m_per_s2: [0, 0, 0]
bodies:
  - name: block
    mesh: {file: block.obj, unit: m}
    pose: {position_world_m: [-0.03, -0.03, 0]}
    material: {young_pa: 15000, poisson: 0.4, damping_per_s: 30}
    fixed: {min_world_m: [-1, -1, -1], max_world_m: [1, 1, 0.004]}
    model: )" +
         model + (model == "surface_springs" ? "" : "\n    volume: {mesher: lattice, tetrahedra: 4000}") +
         "\ntools:\n  - {name: rod, kind: probe}\n";
}

// The elements are wider than the probe: all of it presses within one triangle, whose corners are light.
TEST_F(Feel, a_thin_probe_that_is_pressed_deep_dents_the_skin_and_does_not_sink_in) {
  for (const std::string model : {"surface_springs", "tetra_springs", "neo_hookean"}) {
    SCOPED_TRACE(model);
    Operation operation(scene(block_of(model)));
    operation.place(Vec3(0.0013, 0.0021, kTop_m + 0.001));
    double before_n = 0;
    for (const double depth_m : {0.004, 0.006, 0.008}) {
      operation.move(Vec3(0.0013, 0.0021, kTop_m - depth_m), 0.02);
      operation.rest(100);
      EXPECT_GT(operation.force_n().norm(), 1.1 * before_n) << depth_m;
      before_n = operation.force_n().norm();
    }
    EXPECT_LT(operation.deepest_m, 0.0015);
    operation.expect_valid();
  }
}

TEST_F(Feel, skin_slips_off_a_probe_that_is_pressed_further_than_tissue_goes_and_the_hand_is_told) {
  Operation operation(scene(block_of("neo_hookean")));
  operation.place(Vec3(0.0013, 0.0021, kTop_m + 0.001));
  operation.move(Vec3(0.0013, 0.0021, 0.006), 0.02);
  const auto slipped = std::ranges::find_if(operation.events, [](const Event& e) {
    return e.kind == EventKind::contact_ended && e.text.find("the skin slipped off") != std::string::npos;
  });
  ASSERT_NE(slipped, operation.events.end());
  EXPECT_EQ(operation.force_n().norm(), 0);
  operation.expect_valid();
  operation.move(Vec3(0.0013, 0.0021, kTop_m + 0.005), 0.05);
  operation.rest(500);
  EXPECT_LT(operation.farthest_from_rest_m(), 0.0005);
  operation.move(Vec3(0.0013, 0.0021, kTop_m - 0.002), 0.02);
  EXPECT_EQ(operation.state(), ContactState::contact);
}

}  // namespace
}  // namespace sectio::test

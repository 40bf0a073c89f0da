// A small organ on the table and instruments in hands that the test moves: the real simulation, sample by sample.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <set>
#include <vector>

#include "common/mesh/check.h"
#include "sim_server/engine/engine_table.h"
#include "sim_server/engine/standard_engines.h"
#include "sim_server/prepare/fill_volumes.h"
#include "sim_server/simulation.h"
#include "tests/support/shapes.h"

namespace sectio::test {

constexpr double kOrganTop_m = 0.03;

// An ellipsoid of 120 x 120 x 60 mm and 1280 triangles, held from below, and a scalpel with its sharp side to +x.
inline Scene organ_scene() {
  Scene scene;
  scene.file = "organ";
  scene.gravity_m_per_s2 = Vec3::Zero();
  BodySpec organ;
  organ.name = "organ";
  organ.mesh = ellipsoid(3, Vec3(0.06, 0.06, kOrganTop_m));
  organ.material.skin_thickness_m = 0.004;
  organ.material.foundation_radius_m = 0.02;
  organ.material.pretension = 0.2;
  organ.cutting.threshold_force_n = 0.1;
  organ.fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, -0.01)};
  scene.bodies.push_back(organ);
  scene.tools.resize(1);
  scene.tools[0].name = "scalpel";
  return scene;
}

inline double organ_height_m(double x_m, double y_m) {
  return kOrganTop_m * std::sqrt(1 - (x_m * x_m + y_m * y_m) / (0.06 * 0.06));
}

class Operation {
 public:
  static constexpr double kSample_s = 0.001;

  explicit Operation(Scene s, const EngineTable& engines = standard_engines())
      : scene(fill_volumes(std::move(s))), simulation(scene, engines), hands_(scene.tools.size()) {}

  // A step with no news, or with one sample of one or more instruments.
  const StepOutput& step(const std::vector<std::pair<std::uint32_t, Pose>>& poses) {
    StepInput input;
    for (const auto& [tool, pose] : poses) input.samples.push_back(sample(tool, pose));
    return step(input);
  }
  const StepOutput& step(const StepInput& input) {
    const StepOutput& out = simulation.step(input);
    for (const Event& e : out.events) events.push_back(e);
    deltas += out.deltas.size();
    if (out.report.penetration_m > deepest_m) deepest_m = out.report.penetration_m;
    if (after_each) after_each(out);
    last = out;
    return out;
  }
  ToolSample sample(std::uint32_t tool, const Pose& pose) {
    Hand& hand = hands_[tool];
    hand.pose = pose;
    ++hand.sequence;
    return {tool, hand.sequence, static_cast<double>(last.step + 1) * scene.step_s, pose};
  }

  // Straight and evenly, a sample a step; never less than one.
  void move(const Vec3& to_m, double speed_m_per_s = 0.02, std::uint32_t tool = 0) {
    const Pose from = hands_[tool].pose;
    const int n = std::max(1, static_cast<int>(std::ceil((to_m - from.position_m).norm() / speed_m_per_s / kSample_s)));
    for (int i = 1; i <= n; ++i) step({{tool, {from.position_m + (to_m - from.position_m) * i / n, from.orientation}}});
  }
  // The tip at (x, y), `depth_m` beneath where the skin is when nothing presses.
  void tip_to(double x_m, double y_m, double depth_m, double speed_m_per_s = 0.02, std::uint32_t tool = 0) {
    move({x_m, y_m, organ_height_m(x_m, y_m) - depth_m}, speed_m_per_s, tool);
  }
  void place(const Vec3& at_m, const Eigen::Quaterniond& orientation = Eigen::Quaterniond::Identity(),
             std::uint32_t tool = 0) {
    step({{tool, {at_m, orientation}}});
  }
  void rest(int steps) {
    for (int i = 0; i < steps; ++i) step(StepInput{});
  }
  const Pose& hand(std::uint32_t tool = 0) const { return hands_[tool].pose; }

  std::size_t count(EventKind kind) const {
    std::size_t n = 0;
    for (const Event& e : events) n += e.kind == kind;
    return n;
  }
  ContactState state(std::uint32_t tool = 0) const { return last.contacts.at(tool).state; }
  Vec3 force_n(std::uint32_t tool = 0) const { return last.contacts.at(tool).force_world_n; }
  const TriangleMesh& mesh(std::uint32_t body = 0) const { return simulation.mesh(body); }
  void expect_valid() const {
    const SurfaceReport r = check(mesh());
    ASSERT_TRUE(r.valid()) << r.first_defect;
  }
  // Original edges that a cut has opened: both ends among the vertices of the beginning.
  std::size_t walls() const {
    std::size_t n = 0;
    for (const Triangle& t : mesh().triangles()) n += t.alive() && t.surface == Surface::wall;
    return n;
  }

  Scene scene;
  Simulation simulation;
  StepOutput last;
  std::vector<Event> events;
  std::size_t deltas = 0;
  double deepest_m = 0;
  std::function<void(const StepOutput&)> after_each;

 private:
  struct Hand {
    Pose pose;
    std::uint64_t sequence = 0;
  };
  std::vector<Hand> hands_;
};

}  // namespace sectio::test

#include "tests/support/operation.h"

#include <gtest/gtest.h>
#include <algorithm>
#include <cmath>

#include "common/mesh/check.h"
#include "sim_server/prepare/prepare.h"

namespace sectio::test {

Scene organ_scene() {
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

double organ_height_m(double x_m, double y_m) {
  return kOrganTop_m * std::sqrt(1 - (x_m * x_m + y_m * y_m) / (0.06 * 0.06));
}

Operation::Operation(Scene s, const EngineTable& engines)
    : scene(prepared(std::move(s))), simulation(scene, engines), hands_(scene.tools.size()) {}

const StepOutput& Operation::step(const std::vector<std::pair<std::uint32_t, Pose>>& poses) {
  StepInput input;
  for (const auto& [tool, pose] : poses) input.samples.push_back(sample(tool, pose));
  return step(input);
}

const StepOutput& Operation::step(const StepInput& input) {
  const StepOutput& out = simulation.step(input);
  for (const Event& e : out.events) events.push_back(e);
  deltas += out.deltas.size();
  if (out.report.penetration_m > deepest_m) deepest_m = out.report.penetration_m;
  if (after_each) after_each(out);
  last = out;
  return out;
}

ToolSample Operation::sample(std::uint32_t tool, const Pose& pose) {
  Hand& hand = hands_[tool];
  hand.pose = pose;
  ++hand.sequence;
  return {tool, hand.sequence, static_cast<double>(last.step + 1) * scene.step_s, pose};
}

void Operation::move(const Vec3& to_m, double speed_m_per_s, std::uint32_t tool) {
  const Pose from = hands_[tool].pose;
  const int n = std::max(1, static_cast<int>(std::ceil((to_m - from.position_m).norm() / speed_m_per_s / kSample_s)));
  for (int i = 1; i <= n; ++i) step({{tool, {from.position_m + (to_m - from.position_m) * i / n, from.orientation}}});
}

void Operation::tip_to(double x_m, double y_m, double depth_m, double speed_m_per_s, std::uint32_t tool) {
  move({x_m, y_m, organ_height_m(x_m, y_m) - depth_m}, speed_m_per_s, tool);
}

void Operation::place(const Vec3& at_m, const Eigen::Quaterniond& orientation, std::uint32_t tool) {
  step({{tool, {at_m, orientation}}});
}

void Operation::rest(int steps) {
  for (int i = 0; i < steps; ++i) step(StepInput{});
}

std::size_t Operation::count(EventKind kind) const {
  std::size_t n = 0;
  for (const Event& e : events) n += e.kind == kind;
  return n;
}

double Operation::farthest_from_rest_m() const {
  double most = 0;
  const auto at = simulation.positions_world_m(0);
  for (VertexId v = 0; v < mesh().vertex_slots(); ++v)
    if (mesh().vertex_alive(v))
      most = std::max(most, (at[v].cast<double>() - scene.bodies[0].pose.to_world(mesh().rest_body_m(v))).norm());
  return most;
}

void Operation::expect_valid() const {
  const SurfaceReport r = check(mesh());
  ASSERT_TRUE(r.valid()) << r.first_defect;
}

std::size_t Operation::walls() const {
  std::size_t n = 0;
  for (const Triangle& t : mesh().triangles()) n += t.alive() && t.surface == Surface::wall;
  return n;
}

}  // namespace sectio::test

#include "tests/support/gripper.h"

namespace sectio::test {

ToolSpec tool_of(const std::string& name, const std::string& kind) {
  ToolSpec tool;
  tool.name = name;
  tool.kind = kind;
  tool.geometry = instrument_of(kind).geometry;
  return tool;
}

Scene block_with_forceps(const std::string& model) {
  Scene scene;
  scene.file = "block";
  BodySpec block;
  block.name = "block";
  block.model = model;
  block.mesh = box(12, 12, 8, Vec3(0.06, 0.06, kBlockTop_m));
  block.pose.position_m = Vec3(-0.03, -0.03, 0);
  block.material.foundation_radius_m = 0.02;
  block.volume.tetrahedra = 1500;
  block.volume.least_part_s = 1e-4;
  block.fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, 0.004)};
  scene.bodies.push_back(block);
  scene.tools.push_back(tool_of("forceps", "forceps"));
  scene.tools[0].grip_radius_m = 0.008;
  return scene;
}

Gripper::Gripper(Operation& op, std::uint32_t tool, const Vec3& tips_m)
    : op_(op), tool_(tool), at_{tips_m, {1, 0, 0, 0}} {
  step(0.35);
}

void Gripper::step(double opening_rad) {
  opening_rad_ = opening_rad;
  StepInput input;
  input.samples.push_back(sample());
  op_.step(input);
}

ToolSample Gripper::sample() {
  ToolSample s = op_.sample(tool_, at_);
  s.opening_rad = opening_rad_;
  return s;
}

void Gripper::move(const Vec3& by_m, int steps) {
  const Vec3 from = at_.position_m;
  for (int i = 1; i <= steps; ++i) {
    at_.position_m = from + by_m * i / steps;
    step(opening_rad_);
  }
}

void Gripper::close() {
  for (const double rad : {0.3, 0.2, 0.12, 0.05, 0.0}) step(rad);
}

std::string text_of_last(const Operation& op, EventKind kind) {
  for (auto e = op.events.rbegin(); e != op.events.rend(); ++e)
    if (e->kind == kind) return e->text;
  return "none";
}

std::vector<Vec3> positions_of(const Operation& op, std::uint32_t body) {
  std::vector<Vec3> x;
  for (const Vec3f& p : op.simulation.positions_world_m(body)) x.push_back(p.cast<double>());
  return x;
}

}  // namespace sectio::test

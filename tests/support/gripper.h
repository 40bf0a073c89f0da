// Forceps, shaft upright, that a test closes on a block of any model.
#pragma once

#include <string>

#include "tests/support/block_scene.h"
#include "tests/support/operation.h"

namespace sectio::test {

ToolSpec tool_of(const std::string& name, const std::string& kind);

// 60 x 60 x 40 mm about the z axis, held at its lower side, and one pair of forceps.
Scene block_with_forceps(const std::string& model);

class Gripper {
 public:
  Gripper(Operation& op, std::uint32_t tool, const Vec3& tips_m);

  void step(double opening_rad);
  ToolSample sample();
  void move(const Vec3& by_m, int steps);
  void jump(const Vec3& by_m) { move(by_m, 1); }
  void close();
  void open() { step(0.35); }
  const Vec3& tips_m() const { return at_.position_m; }

 private:
  Operation& op_;
  std::uint32_t tool_;
  Pose at_;
  double opening_rad_ = 0;
};

std::string text_of_last(const Operation& op, EventKind kind);

std::vector<Vec3> positions_of(const Operation& op, std::uint32_t body = 0);

}  // namespace sectio::test

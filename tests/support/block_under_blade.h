// A block of tetrahedra and blades that go where a test says: the engines of a body, without the rest of a simulation.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/mesh/check.h"
#include "sim_server/deformation/tetra/volume_deformation.h"
#include "sim_server/engine/standard_engines.h"
#include "sim_server/simulation.h"
#include "sim_server/volume/volume_cutting.h"
#include "sim_server/world/body.h"
#include "tests/support/shapes.h"

namespace sectio::test {

// A block, held at its lower side, and a knife upright in the plane y z that goes through it along y.
Scene block_under_knife(const std::string& model, double collapse_ratio, const std::string& style);

// The engines of the block, without the rest of a simulation: a blade of any length goes where it is told to.
class BlockUnderBlade {
 public:
  explicit BlockUnderBlade(const std::string& model, double collapse_ratio = 0,
                           const std::string& style = "semi_progressive");

  Body& body() { return body_; }
  const VolumeDeformation& engine() const { return dynamic_cast<const VolumeDeformation&>(*body_.engines.deformation); }
  const VolumeCutting& cutting() const { return dynamic_cast<const VolumeCutting&>(*body_.engines.cutting); }
  double volume_m3() { return check(body_.mesh).volume_m3; }

  double walls_m2() const;

  // The motion of a blade that is 0.1 m long, and its end, if there is nothing else in the step.
  BladeMotion motion(std::uint32_t tool, const Vec3& tip_world_m, const Vec3& up_world, bool lift) const;
  // Nothing but the plan. Blades that are not at work yet come in.
  CutPlan plan(std::span<const BladeMotion> motions);
  // With its edge from z upwards, at y.
  CutPlan plan_to(double y_m, double z_m, bool lift = false);
  // And what comes of it, with a millisecond of deformation.
  CutPlan cut_to(double y_m, double z_m, bool lift = false);
  void go(double to_m, double z_m, const std::function<void(const CutPlan&)>& look = {}, double step_m = 0.0005);

 private:
  TriangleId nearest(const BladeMotion& motion) const;
  static MakeEngines maker(const std::string& model) { return standard_engines().model(model).make; }
  Scene scene_;
  Body body_;
};

}  // namespace sectio::test

// One step of all loose parts of a simulation. Rigid pieces fall, touch floor, bodies and instruments, and come to
// rest; parts that came off and go on deforming touch bodies.
//
// Deformable bodies have deformed before. Contact then changes the velocities of their particles and of the pieces
// alike, and moves particles by the change of their velocities. A sleeping piece bears others as if it could not move,
// and costs only the impulses that it goes on giving to the body that it lies on, unless that body sleeps, too. It
// wakes when something bumps into it, and when a body next to it is touched by an instrument or changed by a cut.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "sim_server/world/body.h"
#include "sim_server/world/grasp.h"

namespace sectio {

// A point of a piece that an instrument presses (unilateral, see PointConstraint).
struct RigidTouch {
  std::uint32_t body_id = 0;
  PointConstraint constraint;  // its source is the edge
  Vec3 tool_velocity_m_per_s = Vec3::Zero();
};

struct RigidInput {
  std::span<const RigidTouch> touches = {};
  std::span<const GraspConstraint> grips = {};
  // By body, whether an instrument touched or held it or a cut changed it in this step; empty: none.
  std::span<const std::uint8_t> disturbed = {};
};

// One reaction a touch, then one a grip.
void step_rigid_pieces(std::span<const std::unique_ptr<Body>> bodies, const RigidInput& input, const Scene& scene,
                       std::span<Reaction> reactions);

}  // namespace sectio

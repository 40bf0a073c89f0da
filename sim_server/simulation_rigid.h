// One step of all rigid pieces of a simulation: they fall, touch floor, bodies and instruments, and come to rest. Part
// of simulation.*.
//
// Deformable bodies bear a piece but don't give way to it: their surface is taken as it moves by itself. A sleeping
// piece wakes when an instrument, a piece that moves, or a change to the body near it stirs it.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "sim_server/simulation_body.h"

namespace sectio {

// An instrument presses a point of a piece (unilateral, see PointConstraint).
struct RigidTouch {
  std::uint32_t body_id = 0;
  PointConstraint constraint;
  Vec3 tool_velocity_m_per_s = Vec3::Zero();
};

// Jaws hold a point of a piece.
struct Grip {
  std::uint32_t body_id = 0;
  Vec3 point_world_m = Vec3::Zero();
  Vec3 to_world_m = Vec3::Zero();  // where it should be
  double largest_force_n = 0;
};

struct RigidInput {
  std::span<const RigidTouch> touches = {};
  std::span<const Grip> grips = {};
  std::span<const std::uint8_t> stirred =
      {};  // by body, whether an instrument touched or a cut changed it in this step
};

// One reaction a touch, then one a grip.
void step_rigid_pieces(std::span<const std::unique_ptr<SimulationBody>> bodies, const RigidInput& input,
                       const Scene& scene, std::span<Reaction> reactions);

}  // namespace sectio

// The local contact model: what the server tells the hand. Between two of these, the bridge evaluates force =
// model(pose) at 1 kHz by itself. (Intermediate representation: Adachi 1995, Mark 1996.) See evaluate() for the
// formula.
#pragma once

#include <cstdint>

#include "common/math/types.h"

namespace sectio {

enum class ContactState : std::uint8_t { free = 0, contact = 1, penetration = 2 };

struct ContactModel {
  std::uint32_t tool_id = 0;
  std::uint64_t sequence = 0;
  double sim_time_s = 0;
  double tool_time_s = 0;  // time stamp of the newest tool sample that the server had used
  ContactState state = ContactState::free;
  Vec3 point_world_m = Vec3::Zero();           // on the plane
  Vec3 normal_world = Vec3::UnitZ();           // unit, out of the tissue
  Vec3 velocity_world_m_per_s = Vec3::Zero();  // of the plane
  Vec3 force_world_n = Vec3::Zero();           // on the tool at tip_world_m, at the time of fitting
  Vec3 tip_world_m = Vec3::Zero();             // tool tip for which force_world_n was computed
  double stiffness_n_per_m = 0;                // along the normal
  double tangential_stiffness_n_per_m = 0;
  double damping_n_s_per_m = 0;
  double friction = 0;                      // Coulomb's coefficient; sideways force sticks up to friction x normal force
  double yield_n = 0;         // the force never exceeds this (rupture or saturation)
  double valid_radius_m = 0;  // past this distance from tip_world_m the force is held, then decays
  double time_to_live_s = 0.05;
};

}  // namespace sectio

// The fields of the messages between hand and server, in the order of the wire (fields.h).
#pragma once

#include "common/messages/contact.h"
#include "common/messages/fields.h"
#include "common/messages/session_fields.h"
#include "common/messages/tool.h"

namespace sectio {

// Its tool and its source are those of the packet.
template <class Visitor, FieldsOf<ToolSample> M>
void fields(Visitor& visit, M& message) {
  [[maybe_unused]] auto& [tool_id, sequence, tool_time_s, pose_world, opening_rad, source] = message;
  visit("sequence_number", sequence);
  visit("tool_time_s", tool_time_s);
  visit("position_world_m", pose_world.position_m, kPosition_m);
  visit("orientation_wxyz", pose_world.orientation);
  visit("opening_rad", opening_rad, at_most(kWidestOpening_rad));
}

template <class Visitor, FieldsOf<ToolPacket> M>
void fields(Visitor& visit, M& message) {
  auto& [source, tool_id, samples] = message;
  visit("source", source);
  visit("tool_id", tool_id, below(kMaxTools));
  visit("poses", samples, from_to(1, kMaxPosesPerPacket));
}

bool is_consistent(const ToolPacket& packet);  // ascending in sequence

template <class Visitor, FieldsOf<ToolWish> M>
void fields(Visitor& visit, M& message) {
  auto& [source, tool_id, sequence, pose_world, held] = message;
  visit("source", source);
  visit("tool_id", tool_id, below(kMaxTools));
  visit("sequence_number", sequence);
  visit("position_world_m", pose_world.position_m, kPosition_m);
  visit("orientation_wxyz", pose_world.orientation);
  visit("opening_rad", pose_world.opening_rad, at_most(kWidestOpening_rad));
  visit("is_held", held);
}

template <class Visitor, FieldsOf<ContactModel> M>
void fields(Visitor& visit, M& message) {
  auto& [tool_id, sequence, sim_time_s, tool_time_s, state, force_world_n, lever_world_m, point_world_m, normal_world,
         velocity_world_m_per_s, stiffness_n_per_m, damping_n_s_per_m, mass_kg, soft_depth_m, side_stiffness_n_per_m,
         friction, yield_n] = message;
  visit("tool_id", tool_id, below(kMaxTools));
  visit("sequence_number", sequence);
  visit("sim_time_s", sim_time_s);
  visit("tool_time_s", tool_time_s);
  visit("state", state, at_most(static_cast<double>(ContactState::held)));
  visit("force_world_n", force_world_n);
  visit("lever_world_m", lever_world_m, kPosition_m);
  visit("point_world_m", point_world_m, kPosition_m);
  visit("normal_world", normal_world);
  visit("velocity_world_m_per_s", velocity_world_m_per_s);
  visit("stiffness_n_per_m", stiffness_n_per_m, kNotNegative);
  visit("damping_n_s_per_m", damping_n_s_per_m, kNotNegative);
  visit("mass_kg", mass_kg, kNotNegative);
  visit("soft_depth_m", soft_depth_m, kNotNegative);
  visit("side_stiffness_n_per_m", side_stiffness_n_per_m, kNotNegative);
  visit("friction_coefficient", friction, kNotNegative);
  visit("yield_n", yield_n, kNotNegative);
}

bool is_consistent(const ContactModel& model);  // its normal has length 1

template <class Visitor, FieldsOf<ContactMessage> M>
void fields(Visitor& visit, M& message) {
  auto& [epoch, model] = message;
  visit("epoch", epoch);
  visit("model", model);
}

}  // namespace sectio

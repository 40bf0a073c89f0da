// The fields of the messages of state.h, in the order of the wire (fields.h).
#pragma once

#include "common/messages/fields.h"
#include "common/messages/session_fields.h"
#include "common/messages/state.h"

namespace sectio {

template <class Visitor, FieldsOf<ToolState> M>
void fields(Visitor& visit, M& message) {
  auto& [present, pose_world] = message;
  visit("present", present);
  visit("position_world_m", pose_world.position_m, kPosition_m);
  visit("orientation_wxyz", pose_world.orientation);
  visit("opening_rad", pose_world.opening_rad, at_most(kWidestOpening_rad));
}

template <class Visitor, FieldsOf<BodyState> M>
void fields(Visitor& visit, M& message) {
  auto& [revision, vertex_slots, pieces_sent, scalars] = message;
  visit("revision", revision);
  visit("vertex_slots", vertex_slots, at_most(kMaxVertexSlots));
  visit("pieces_sent", pieces_sent, at_most(piece_count(kMaxVertexSlots)));
  visit("scalars", scalars, at_most(kMaxScalars), kName);
}

bool is_consistent(const BodyState& body);  // a bit for each piece, and no other bit is set

template <class Visitor, FieldsOf<StateHeader> M>
void fields(Visitor& visit, M& message) {
  auto& [epoch, step, sim_time_s, step_wall_time_s, in_contact, tools, bodies, gravity_m_per_s2, sent_s] = message;
  visit("epoch", epoch);
  visit("step", step);
  visit("sim_time_s", sim_time_s);
  visit("step_wall_time_s", step_wall_time_s, kNotNegative);
  visit("in_contact", in_contact);
  visit("tools", tools, at_most(kMaxTools));
  visit("bodies", bodies, at_most(kMaxBodies));
  visit("gravity_world_m_per_s2", gravity_m_per_s2, kGravity_m_per_s2);
  visit("sent_s", sent_s);
}

template <class Visitor, FieldsOf<StatePiece> M>
void fields(Visitor& visit, M& message) {
  auto& [epoch, step, revision, body_id, piece, quantum_m, origin_quanta, offsets_quanta] = message;
  visit("epoch", epoch);
  visit("step", step);
  visit("revision", revision);
  visit("body_id", body_id, below(kMaxBodies));
  visit("piece", piece, below(piece_count(kMaxVertexSlots)));
  visit("quantum_m", quantum_m);
  visit("origin_quanta", origin_quanta);
  visit("offsets_quanta", offsets_quanta, from_to(3, 3 * kVerticesPerPiece));
}

bool is_consistent(const StatePiece& piece);  // whole vertices; the quantum is one that exists

template <class Visitor, FieldsOf<ScalarField> M>
void fields(Visitor& visit, M& message) {
  auto& [name, least, most, values] = message;
  visit("name", name, kName);
  visit("least", least);
  visit("most", most);
  visit("values", values, at_most(kMaxVertexSlots));
}

bool is_consistent(const ScalarField& field);  // its range is not empty

template <class Visitor, FieldsOf<ScalarPiece> M>
void fields(Visitor& visit, M& message) {
  auto& [epoch, step, revision, body_id, piece, name, least, most, levels] = message;
  visit("epoch", epoch);
  visit("step", step);
  visit("revision", revision);
  visit("body_id", body_id, below(kMaxBodies));
  visit("piece", piece, below(piece_count(kMaxVertexSlots)));
  visit("name", name, kName);
  visit("least", least);
  visit("most", most);
  visit("levels", levels, from_to(1, kVerticesPerPiece));
}

bool is_consistent(const ScalarPiece& piece);  // its range is not empty

}  // namespace sectio

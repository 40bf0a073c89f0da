// The fields of the messages of inputs.h, in the order of the wire (fields.h).
#pragma once

#include "common/messages/fields.h"
#include "common/messages/inputs.h"
#include "common/messages/tool_fields.h"

namespace sectio {

template <class Visitor, FieldsOf<StepRecord> M>
void fields(Visitor& visit, M& message) {
  auto& [step, hash_before, state_hash_before, packets, withdrawn_tools, spare_idle_bodies, turns_gravity,
         gravity_m_per_s2, overrun] = message;
  visit("step", step, kNotNegative);
  visit("hash_before", hash_before);
  visit("state_hash_before", state_hash_before);
  visit("packets", packets, at_most(kMaxPacketsPerStep));
  visit("withdrawn_tools", withdrawn_tools, at_most(kMaxTools), below(kMaxTools));
  visit("is_sparing_idle_bodies", spare_idle_bodies);
  visit("is_turning_gravity", turns_gravity);
  visit("gravity_world_m_per_s2", gravity_m_per_s2, kGravity_m_per_s2);
  visit("overrun", overrun, at_most(kMaxEventTextBytes));
}

template <class Visitor, FieldsOf<StepInputs> M>
void fields(Visitor& visit, M& message) {
  auto& [epoch, newest_step, steps] = message;
  visit("epoch", epoch);
  visit("newest_step", newest_step);
  visit("steps", steps, at_most(kMaxRecordsPerMessage));
}

bool is_consistent(const StepInputs& inputs);  // ascending in step, without holes

template <class Visitor, FieldsOf<StepRequest> M>
void fields(Visitor& visit, M& message) {
  auto& [epoch, first_step, client] = message;
  visit("epoch", epoch);
  visit("first_step", first_step);
  visit("client", client);
}

}  // namespace sectio

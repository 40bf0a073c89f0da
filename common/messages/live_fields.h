// The fields of the messages of live.h, in the order in which they travel (fields.h).
#pragma once

#include "common/messages/fields.h"
#include "common/messages/live.h"
#include "common/messages/session_fields.h"

namespace sectio {

template <class Visitor, FieldsOf<Hello> M>
void fields(Visitor& visit, M& message) {
  auto& [name, token] = message;
  visit("name", name, at_most(kMaxNameBytes));
  visit("token", token, at_most(kMaxTokenBytes));
}

template <class Visitor, FieldsOf<ToolClaim> M>
void fields(Visitor& visit, M& message) {
  auto& [tool_id, action, person] = message;
  visit("tool_id", tool_id, below(kMaxTools));
  visit("action", action, at_most(static_cast<double>(ClaimAction::release)));
  visit("person", person);
}

template <class Visitor, FieldsOf<Person> M>
void fields(Visitor& visit, M& message) {
  auto& [id, name, may_write, may_lead] = message;
  visit("id", id);
  visit("name", name, kName);
  visit("may_write", may_write);
  visit("may_lead", may_lead);
}

template <class Visitor, FieldsOf<Roster> M>
void fields(Visitor& visit, M& message) {
  auto& [you, people, holders] = message;
  visit("you", you);
  visit("people", people, at_most(kMaxPeople));
  visit("holders", holders, at_most(kMaxTools));
}

template <class Visitor, FieldsOf<Notice> M>
void fields(Visitor& visit, M& message) {
  auto& [text] = message;
  visit("text", text, at_most(kMaxEventTextBytes));
}

}  // namespace sectio

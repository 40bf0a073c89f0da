// Messages between a page in a browser and the gateway (render_client/gateway) over a WebSocket, beside messages
// of the wire that the gateway passes on. A frame of the socket holds one or more messages (live_frame.h).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/messages/session.h"

namespace sectio {

// The version stands in the subprotocol of the socket, with that of the wire. It goes up with every change of a message
// of this file, or of the meaning of one.
constexpr std::uint32_t kLiveVersion = 2;
std::string live_protocol();  // "sectio-live-10.2": version 10 of the wire, version 2 of this

constexpr std::size_t kMaxPeople = 1024;
constexpr std::size_t kMaxTokenBytes = 128;
constexpr std::uint32_t kNobody = 0;

// The first message of a page. A person without the token watches.
struct Hello {
  std::string name;
  std::string token;  // empty: to watch
};

enum class ClaimAction : std::uint8_t {
  claim,    // an instrument that nobody holds
  take,     // an instrument, whoever holds it
  give,     // the own instrument, to `person`
  release,  // the own instrument
};

struct ToolClaim {
  std::uint32_t tool_id = 0;
  ClaimAction action = ClaimAction::claim;
  std::uint32_t person = kNobody;  // give: to this person
};

struct Person {
  std::uint32_t id = kNobody;
  std::string name;
  bool may_write = false;  // hold instruments
  bool may_lead = false;   // give orders (SessionOrder)
  bool operator==(const Person&) const = default;
};

// The people present and the holder of each instrument. It is sent to everybody whenever it has changed.
struct Roster {
  std::uint32_t you = kNobody;  // the person to whom this copy goes
  std::vector<Person> people;
  std::vector<std::uint32_t> holders;  // one a tool of the scene: the id of a person, or kNobody
};

// A line for the person at the page: why something was refused, who has taken an instrument.
struct Notice {
  std::string text;
};

}  // namespace sectio

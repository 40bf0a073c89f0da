// Orders of the person at this viewer to all servers of its session. A participant of its own: with keys, a viewer that
// only looks may not write that topic.
#pragma once

#include <memory>

#include "common/dds/participant.h"
#include "common/messages/session.h"

namespace sectio {

// One thread; nothing blocks.
class SessionLeader {
 public:
  // Throws InputError for bad options, and for keys that may give no orders.
  explicit SessionLeader(const NetworkOptions& options);
  ~SessionLeader();

  // A program that was asleep joins the session anew here.
  void poll();
  // The order gets a source of its own. A server that refuses it says so in an event; a warning tells that no server
  // hears it.
  void give(SessionOrder order);

 private:
  struct Wire;
  std::unique_ptr<Wire> wire_;
};

}  // namespace sectio

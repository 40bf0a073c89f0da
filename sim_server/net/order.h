// Gives an order to the servers of a session: `sim_server tilt`, `pause`, `go-on`, `freeze`, `thaw`, `speed`,
// `anew`, `score`, `seek`. A viewer writes that topic where its person leads
// the session (render_client --lead).
#pragma once

#include "common/dds/participant.h"
#include "common/messages/session.h"

namespace sectio {

// The command's name.
const char* to_string(OrderKind kind);
// The text of an event `order_refused`: the command's name, ": ", and why.
std::string refusal(const SessionOrder& order, const std::string& why);

// A server that has two orders at once to go to some moment may leave the earlier one out, when the later one leads to
// its own moment all the same: servers that have them one after the other come to that moment, too.
bool stands_for(const SessionOrder& later, const SessionOrder& earlier);

// Returns when every server that speaks has said that it obeys. The lines that the servers say of it go to the standard
// output. Throws InputError when no server does within the time, when one of several doesn't or refuses, with the
// reason, and when the order is out of bounds, which names the command's `flag` that says what is wanted, or none.
void give_order(NetworkOptions network, SessionOrder order, double patience_s, const std::string& flag);

}  // namespace sectio

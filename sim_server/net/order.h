// Gives an order to the servers of a session: `sim_server tilt`, `pause`, `go-on`, `freeze`, `thaw`, `speed`,
// `anew`, `score`, `seek`. Viewers don't write that topic.
#pragma once

#include <string>

#include "common/dds/participant.h"
#include "common/messages/session.h"

namespace sectio {

// Returns when every server that speaks has said that it obeys; `name`: the command, for messages. The lines that the
// servers say of it go to the standard output. Throws InputError when no server does within the time, or one of several
// doesn't, and when the order is out of bounds.
void give_order(NetworkOptions network, SessionOrder order, const std::string& name, double patience_s);

}  // namespace sectio

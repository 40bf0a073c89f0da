// What the servers of a session say of themselves and their bodies: `sim_server status`.
#pragma once

#include <string>

#include "common/dds/participant.h"

namespace sectio {

// A line a body: what was expected of its model and what it does. Throws InputError when no server is heard in time.
std::string status_of_session(const NetworkOptions& network, double patience_s);

}  // namespace sectio

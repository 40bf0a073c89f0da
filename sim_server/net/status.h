// How the servers of a session and their bodies are doing: `sim_server status`.
#pragma once

#include <string>

#include "common/dds/participant.h"

namespace sectio {

// A line a body: how its model was expected to do and how it does; or every field of what the servers say. Throws
// InputError when no server is heard in time, or none that has this body. Empty: any will do.
std::string status_of_session(NetworkOptions network, double patience_s, bool every_field = false,
                              const std::string& body = {});

}  // namespace sectio

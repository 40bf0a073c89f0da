// The network flags that every program has.
#pragma once

#include <string>

#include "common/core/arguments.h"
#include "common/dds/participant.h"

namespace sectio {

// --session, which `session_help` explains, --domain, --peer, --interface, --keys, --insecure.
void add_network_arguments(Arguments& arguments, NetworkOptions& options, const std::string& session_help);

}  // namespace sectio

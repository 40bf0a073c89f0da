// The flags by which every program takes its seat at the table.
#pragma once

#include <string>

#include "common/core/arguments.h"
#include "common/dds/participant.h"

namespace sectio {

// --session (its meaning for this program is told by session_help), --domain, --peer, --interface.
void add_network_arguments(Arguments& arguments, NetworkOptions& options, const std::string& session_help);

}  // namespace sectio

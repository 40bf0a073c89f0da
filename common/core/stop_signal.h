// SIGINT, SIGTERM and, when a terminal is closed, SIGHUP end a program in order.
#pragma once

#include <vector>

namespace sectio {

// SIGHUP is none of them where it is ignored (nohup).
std::vector<int> stop_signals();
// From this call on, stop signals are only remembered. A log that nobody reads any more ends nothing: SIGPIPE is
// ignored.
void catch_stop_signals();
bool stop_was_requested();

}  // namespace sectio

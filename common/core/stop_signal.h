// SIGINT, SIGTERM and, when a terminal is closed, SIGHUP end a program in order.
#pragma once

#include <vector>

namespace sectio {

// SIGHUP is none of them where it is ignored (nohup).
std::vector<int> stop_signals();
// From now on they are only remembered.
void catch_stop_signals();
bool stop_was_requested();

}  // namespace sectio

// SIGINT and SIGTERM end a session in order.
#pragma once

namespace sectio {

// From now on they are only remembered.
void catch_stop_signals();
bool stop_was_requested();

}  // namespace sectio

// Shows a record in a session of its own, from any moment on: its messages, not a simulation.
#pragma once

#include "sim_server/net/serve.h"

namespace sectio {

// The end of the record ends the session. It uses these options: the network (an empty session means the record's own),
// the file `play`, the speed, from_s and wait_for_viewers. Returns the exit code of the program: kExitNotOk when the
// bodies aren't those with which the record ends. Throws InputError when the file shows nothing, and when the session
// has another server with these bodies.
int play_record(const ServeOptions& options);

}  // namespace sectio

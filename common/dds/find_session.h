// For programs that were started without --session.
#pragma once

#include <functional>

#include "common/dds/participant.h"

namespace sectio {

// Fills in an empty options.session: the only session for which a server of the domain is there. Waits for one for
// patience_s, or until stopped() says so; false only in that case. Throws InputError when none has come, and when there
// are several: then it lists them.
bool find_session(NetworkOptions& options, double patience_s, const std::function<bool()>& stopped);

}  // namespace sectio

// Asks the servers of a session to turn gravity: `sim_server tilt`. Viewers don't write that topic.
#pragma once

#include "common/dds/participant.h"
#include "common/math/types.h"

namespace sectio {

// Returns when every server that speaks has said that it turns gravity there. Throws InputError when no server says so
// within the time, or one of several doesn't.
void request_gravity(NetworkOptions network, const Vec3& gravity_m_per_s2, double patience_s);

}  // namespace sectio

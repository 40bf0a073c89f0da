// Asks the servers of a session to turn gravity: `sim_server tilt`. Viewers have no such writer.
#pragma once

#include "common/dds/participant.h"
#include "common/math/types.h"

namespace sectio {

// Returns when every server that speaks has said that it turns it there; throws InputError when none has, or one
// hasn't, within the time.
void request_gravity(const NetworkOptions& network, const Vec3& gravity_m_per_s2, double patience_s);

}  // namespace sectio

// A domain and a session of its own for each test, on loopback: tests of one machine may run at the same time. Domains
// up to 100 keep clear of the ports that the system gives away.
#pragma once

#include "common/dds/participant.h"

namespace sectio::test {

NetworkOptions own_session();

}  // namespace sectio::test

// Whether a program listens at a port.
#pragma once

#include <string>

namespace sectio {

bool listens_at(const std::string& host, int port);

}  // namespace sectio

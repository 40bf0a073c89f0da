// The bodies of a session from its journal: `sim_server replay`.
#pragma once

#include <string>

namespace sectio {

// Returns a line for each turn of gravity and each body, with its topology hash. With a directory, writes the surfaces
// as OBJ, at rest. Throws InputError that names file and byte.
std::string replay(const std::string& journal, const std::string& export_directory);

}  // namespace sectio

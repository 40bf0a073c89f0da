// The bodies of a session from its journal: `sim_server replay`.
#pragma once

#include <string>

namespace sectio {

// Returns a line for each turn of gravity, for each body with its topology hash, and for each scalar that an engine
// published last of a body. With a directory, writes the surfaces as OBJ, at rest, and the scalars as BODY.FIELD.csv.
// A damaged journal is read as far as it is whole: `damage` names the byte. Throws InputError when nothing is.
std::string replay(const std::string& journal, const std::string& export_directory, std::string& damage);

}  // namespace sectio

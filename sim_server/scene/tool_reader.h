// The keys of an instrument in a scene file.
#pragma once

#include "sim_server/scene/key_reader.h"
#include "sim_server/scene/scene.h"

namespace sectio {

// The path of the trace stays as it is in the file; no other file is read. Throws InputError.
ToolSpec read_tool(KeyReader& map);

}  // namespace sectio

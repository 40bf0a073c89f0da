// A run without network.
#pragma once

#include <string>

#include "sim_server/scene/scene.h"
#include "sim_server/session/verdict.h"

namespace sectio {

// Runs a prepared scene (prepare/prepare.h) on its own traces as fast as it goes, for `steps` or, when that is 0, its
// duration. With a directory, leaves there what SessionRun does.
RunResult run_offline(const Scene& scene, std::uint64_t steps, const std::string& directory);

}  // namespace sectio

// A shipped scene with a finer mesh.
#pragma once

#include <filesystem>
#include <string>

namespace sectio::test {

// Writes a copy of a scene of deploy/scenes into `directory`, and returns its path. Each triangle of its first body is
// divided into four, `times` over; the copy lasts for `duration_s`. Throws std::runtime_error.
std::string fine_scene(const std::string& name, int times, double duration_s, const std::filesystem::path& directory);

}  // namespace sectio::test

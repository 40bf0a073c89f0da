// The directory of the program that runs: its helpers lie beside it, or in known places from there.
#pragma once

#include <filesystem>
#include <system_error>

namespace sectio {

// Empty: the system doesn't tell.
inline std::filesystem::path own_directory() {
  std::error_code unknown;
  return std::filesystem::read_symlink("/proc/self/exe", unknown).parent_path();
}

}  // namespace sectio

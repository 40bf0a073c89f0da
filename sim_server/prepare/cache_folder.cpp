#include "sim_server/prepare/cache_folder.h"

#include <unistd.h>

#include <cstdlib>
#include <fstream>

namespace sectio {

std::filesystem::path cache_folder() {
  const char* cache = std::getenv("XDG_CACHE_HOME");
  const char* home = std::getenv("HOME");
  if (cache && *cache) return std::filesystem::path(cache) / "sectio";
  if (home && *home) return std::filesystem::path(home) / ".cache" / "sectio";
  return {};
}

void write_to_cache(const std::filesystem::path& file, const std::string& text) {
  std::error_code error;
  std::filesystem::create_directories(file.parent_path(), error);
  const std::filesystem::path part = file.string() + "." + std::to_string(::getpid());
  std::ofstream out(part);
  out << text;
  out.close();
  out ? std::filesystem::rename(part, file, error) : static_cast<void>(std::filesystem::remove(part, error));
}

}  // namespace sectio
